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

/// v.assign(n, x), likewise: a list that grows by one would move to pages that were never touched.
template <class T>
void assignSparingly(std::vector<T>& v, std::size_t n, const T& x) {
  if (n > v.capacity()) {
    release(v);
    v.reserve(n + n / 32);
  }
  v.assign(n, x);
}

/// [bytes] Room for that is kept where it is not needed.
inline constexpr std::size_t littleMemory = std::size_t{1} << 14U;

/// [bytes] From here on room is kept all the same: the allocator would give it back to the system, and to
/// touch it anew in every part of every step costs more than the sweeps that it is for.
inline constexpr std::size_t muchMemory = std::size_t{1} << 20U;

/// Leaves the room of what one part of a step fills, and no later one reads, to others, unless it is little
/// or much.
template <class T>
void giveBack(std::vector<T>& v) {
  if (v.capacity() > littleMemory / sizeof(T) && v.capacity() < muchMemory / sizeof(T)) {
    release(v);
  }
}

/// v.clear() that gives back room of which the last use filled less than a quarter: a heap that fell has
/// blows by the thousand in a step, and none once it rests.
template <class T>
void clearSpare(std::vector<T>& v) {
  if (v.capacity() > 4 * v.size() + littleMemory / sizeof(T)) {
    release(v);
  } else {
    v.clear();
  }
}

}  // namespace gravel::detail
