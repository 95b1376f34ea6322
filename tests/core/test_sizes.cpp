#include "support/archetypes.hpp"
#include "support/catch.hpp"
#include <gravel/core/sizes.hpp>

using namespace gravel;
using namespace gravel::test;

// Seen to fail: 0 as both, which is what Eigen has of a scalar without numeric_limits.
TEST_CASE("Roundoff and range of a user's scalar are found where it does not tell them") {
  CHECK(detail::roundoff<MinimalReal>().inTest() == std::numeric_limits<double>::epsilon());
  CHECK(detail::roundoff<MinimalRealOf<float>>().inTest() == std::numeric_limits<float>::epsilon());
  CHECK(detail::roundoff<long double>() == std::numeric_limits<long double>::epsilon());
  CHECK(detail::highest<float>() == std::numeric_limits<float>::max());
  CHECK(detail::highest<MinimalReal>().inTest() == std::numeric_limits<double>::max());
  const double most = detail::highest<MinimalRealOf<float>>().inTest();
  CHECK(most <= std::numeric_limits<float>::max());
  CHECK(4 * most > std::numeric_limits<float>::max());
}
