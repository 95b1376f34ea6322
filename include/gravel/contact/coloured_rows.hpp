#pragma once

/// \file
/// Passes over the rows of a ContactColoring, shared between threads.

#include <gravel/contact/contact_coloring.hpp>

namespace gravel {

namespace detail {

/// Calls f(from, to, sum), which adds to the sum, for the parts of rows [begin, end) that share no movable
/// body, shared between threads where they are many; parts depend on their number alone.
template <class T, class F>
T sumOverParts(std::size_t begin, std::size_t end, const T& zero, F&& f) {
  const auto run = [&](std::size_t from, std::size_t to) {
    T sum = zero;
    f(from, to, sum);
    return sum;
  };
  if (end - begin < ContactColoring::fewRows) {
    return run(begin, end);
  }
  return orderedSum(end - begin, ContactColoring::partSize, zero,
                    [&](std::size_t from, std::size_t to) { return run(begin + from, begin + to); });
}

/// Calls f(from, to, sum) for all parts of the rows at once: they may share bodies.
template <class T, class F>
T sumOverAllParts(const ContactColoring& colouring, const T& zero, F&& f) {
  return orderedSum(colouring.parts().size(), colouring.partsOfTask(), zero,
                    [&](std::size_t begin, std::size_t end) {
                      T sum = zero;
                      for (std::size_t p = begin; p < end; ++p) {
                        const ContactColoring::Part& part = colouring.parts()[p];
                        f(std::size_t{part.begin}, std::size_t{part.end}, sum);
                      }
                      return sum;
                    });
}

/// The same without a sum.
template <class F>
void forAllParts(const ContactColoring& colouring, F&& f) {
  parallelFor(colouring.parts().size(), colouring.partsOfTask(), [&](std::size_t p) {
    const ContactColoring::Part& part = colouring.parts()[p];
    f(std::size_t{part.begin}, std::size_t{part.end});
  });
}

/// As sumOverParts() over all rows but the lone ones, blocks from the first one on side by side, then colour
/// after colour, and the overflow one by one.
/// \param wanted  called with each block, counted from the first one: whether to visit its rows
template <class T, class F, class Wanted>
T sumOverColourParts(const ContactColoring& colouring, const T& zero, F&& f, std::size_t first,
                     Wanted&& wanted) {
  T sum = orderedSum(colouring.blocks() - first, 1, zero, [&](std::size_t block, std::size_t /*next*/) {
    T part = zero;
    if (wanted(block)) {
      for (const ContactColoring::Part& rows : colouring.coloursOf(first + block)) {
        f(std::size_t{rows.begin}, std::size_t{rows.end}, part);
      }
    }
    return part;
  });
  for (std::size_t c = 0; c < colouring.colours(); ++c) {
    sum += sumOverParts(colouring.begin(c), colouring.end(c), zero, f);
  }
  const std::size_t overflow = colouring.colours();
  for (std::size_t k = colouring.begin(overflow); k < colouring.end(overflow); ++k) {
    f(k, k + 1, sum);
  }
  return sum;
}

/// The same with every block.
template <class T, class F>
T sumOverColourParts(const ContactColoring& colouring, const T& zero, F&& f) {
  return sumOverColourParts(colouring, zero, f, 0, [](std::size_t) { return true; });
}

/// The same without the rows of small islands; \param wanted  of blocks of bodies
template <class T, class F, class Wanted>
T sumOverLargeParts(const ContactColoring& colouring, const T& zero, F&& f, Wanted&& wanted) {
  return sumOverColourParts(colouring, zero, f, colouring.bundles(), wanted);
}
template <class T, class F>
T sumOverLargeParts(const ContactColoring& colouring, const T& zero, F&& f) {
  return sumOverLargeParts(colouring, zero, f, [](std::size_t) { return true; });
}

}  // namespace detail

}  // namespace gravel
