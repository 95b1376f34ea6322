#pragma once

/// Catch2 2 and 3 under one include. The matchers WithinAbs, WithinRel and ContainsSubstring have the same
/// name on both: `CHECK_THAT(x, WithinAbs(y, tolerance))` with `using namespace gravel::test`.

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_message.hpp>
#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators_all.hpp>
#include <catch2/matchers/catch_matchers_all.hpp>
#elif __has_include(<catch2/catch.hpp>)
#include <catch2/catch.hpp>
#else
#error "gravel: the tests need Catch2, version 2.13 or 3 (Debian and Ubuntu: apt install catch2)"
#endif

#include <string>

/// Defined where a sanitizer makes programs an order of magnitude slower, to run and to compile.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define GRAVEL_TEST_SLOW
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer) || __has_feature(address_sanitizer)
#define GRAVEL_TEST_SLOW
#endif
#endif

/// Types of a TEMPLATE_TEST_CASE: all of them, or the first alone where that is slow.
#ifdef GRAVEL_TEST_SLOW
#define GRAVEL_TEST_TYPES(first, ...) first
#else
#define GRAVEL_TEST_TYPES(first, ...) first, __VA_ARGS__
#endif

namespace gravel::test {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

#if __has_include(<catch2/catch_all.hpp>)
using Catch::Matchers::ContainsSubstring;
#else
inline auto ContainsSubstring(const std::string& text) { return Catch::Matchers::Contains(text); }
#endif

}  // namespace gravel::test
