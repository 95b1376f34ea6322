#pragma once

/// \file
/// Which blocks of bodies a pass over contacts may leave out.

#include <gravel/contact/contact_coloring.hpp>

#include <atomic>
#include <cstdint>
#include <vector>

namespace gravel::detail {

/// Passes that look at contacts whose bodies have moved alone need not even ask those of a block in which
/// nobody has moved since it was looked at last: of a million bodies at rest but for some, asking is most of
/// a pass. None where the colouring has no blocks of bodies.
class StirredBlocks {
 public:
  /// All blocks are to be visited.
  void begin(const ContactColoring& colouring) {
    stirred_.assign(colouring.blocks() - colouring.bundles(), 1);
  }

  /// The body of this slot has moved. May be called by several threads at once.
  void stir(std::uint32_t slot) {
    if (!stirred_.empty()) {
      std::atomic_ref(stirred_[ContactColoring::blockOf(slot)]).store(1, std::memory_order_relaxed);
    }
  }

  /// A visit to block `block` of bodies. \return whether one of its bodies has moved since the last visit
  bool visit(std::size_t block) {
    return std::atomic_ref(stirred_[block]).exchange(0, std::memory_order_relaxed) != 0;
  }

 private:
  std::vector<std::uint8_t> stirred_;  ///< by block of bodies
};

}  // namespace gravel::detail
