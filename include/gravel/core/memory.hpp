#pragma once

/// \file
/// Workspaces that are kept from step to step, without much room to spare.

#include <cstddef>
#include <vector>

namespace gravel::detail {

/// Gives all of it back.
template <class T>
void release(std::vector<T>& v) {
  std::vector<T>().swap(v);
}

/// v.resize(n) that leaves room for a thirty-second more where it has to grow, not for as many again: lists
/// by contact are the most of a heap's memory, and their length hardly changes.
template <class T>
void resizeSparingly(std::vector<T>& v, std::size_t n) {
  if (n > v.capacity()) {
    v.reserve(n + n / 32);
  }
  v.resize(n);
}

/// The same for values that are of no use any more: they are not moved to where there is room.
template <class T>
void resizeAnew(std::vector<T>& v, std::size_t n) {
  if (n > v.capacity()) {
    release(v);
  }
  resizeSparingly(v, n);
}

/// Room for so many is kept where it is not needed.
inline constexpr std::size_t fewEntries = 1024;

/// [bytes] From here on allocators map memory anew at each use (32 MB with glibc), which costs time: 360 000
/// bodies had twice the page faults.
inline constexpr std::size_t mappedAnew = std::size_t{1} << 25U;

/// Leaves the room of what one part of a step fills, and no later one reads, to others, unless it is little,
/// or would have to be mapped anew.
template <class T>
void giveBack(std::vector<T>& v) {
  if (v.capacity() > fewEntries && v.capacity() < mappedAnew / sizeof(T)) {
    release(v);
  }
}

/// v.clear() that gives back room of which the last use filled less than a quarter: a heap that fell has
/// blows by the thousand in a step, and none once it rests.
template <class T>
void clearSpare(std::vector<T>& v) {
  if (v.capacity() > 4 * v.size() + fewEntries) {
    release(v);
  } else {
    v.clear();
  }
}

}  // namespace gravel::detail
