// error: deleted
#include <gravel/bodies/bodies.hpp>

#include <type_traits>

using Proxy = gravel::BodyProxy<double, gravel::SoA>;
using ConstProxy = gravel::ConstBodyProxy<double, gravel::SoA>;

static_assert(std::is_convertible_v<Proxy, ConstProxy>);
static_assert(!std::is_convertible_v<ConstProxy, Proxy>);
static_assert(!std::is_constructible_v<Proxy, ConstProxy>);
static_assert(std::is_trivially_copyable_v<Proxy> && std::is_trivially_copyable_v<ConstProxy>);
static_assert(!std::is_copy_assignable_v<Proxy> && !std::is_copy_assignable_v<ConstProxy>);

void copy(Proxy to, ConstProxy from) {
#if GRAVEL_WRONG == 1
  to = Proxy(to);
#else
  to.store(from.load());
#endif
  to.position() = from.position();
}
