#pragma once

/// \file
/// An order in which contacts can be solved at once: no two contacts of one colour share a movable body.

#include <gravel/contact/contact_slots.hpp>
#include <gravel/contact/row_parts.hpp>
#include <gravel/contact/solver_islands.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gravel {

/// Colours of the contacts, greedily in the order of the list, which is that of the keys, in each block: a
/// function of ids alone. Fixed bodies and boundaries take part in any number of contacts of a colour.
/// Contacts that find no colour among 62 (of a body with very many partners) go to an overflow group that is
/// solved serially. Contacts that share no movable body with any other make up a group of their own, the lone
/// ones, which are exact after one blow. Of more bodies than caches hold, contacts within a block of bodies
/// whose ids follow each other come block by block, and in each colour by colour, before the contacts between
/// blocks: bodies are fetched once in place of once a colour, and blocks are solved at once. O(contacts),
/// with a sort of those bodies that are first in no contact, and O(bodies) once for the largest number of
/// them.
class ContactColoring {
 public:
  static constexpr std::size_t maxColours = 62;

  using Row = detail::SlotRow;

  /// \param contacts sorted by keys, which are the ids of the bodies
  /// \throws std::invalid_argument for a contact of no body or of a body with itself, or out of order
  template <Real S, ContactBodies B>
  void build(std::span<const Contact<S>> contacts, const B& bodies) {
    takeEnds(contacts, bodies.size());
    slots_.number(byContact_, bodies);
    islands_.find(std::span<const Row>(byContact_), slots_.movable());
    islands_.bundle(std::span<const Row>(byContact_), slots_.degree(), maxColours);
    choose();
    arrange();
    islands_.forgetNumbers();
    detail::giveBack(byContact_);
    slots_.forgetDegrees();
    detail::giveBack(group_);
    detail::giveBack(used_);
  }

  using Part = detail::RowPart;

  /// Rows in the order of solving: lone ones, those of small islands by bundle, within blocks, colour 0, 1,
  /// …, overflow.
  std::span<const Row> rows() const { return rows_; }
  std::size_t loneCount() const { return loneCount_; }
  const detail::SolverIslands& islands() const { return islands_; }
  /// The slot of the two by which islands() knows a row.
  std::uint32_t ofIsland(const Row& row) const { return movable(row.slot1) ? row.slot1 : row.slot2; }
  std::size_t islandsEnd() const { return islandsEnd_; }  ///< where rows of small islands end
  bool isOfLarge(std::size_t k) const { return k >= islandsEnd_; }
  /// The number of that of row k, if loneCount() <= k < islandsEnd().
  std::uint32_t islandOf(std::size_t k) const { return islandOfRow_[k - loneCount_]; }
  /// Blocks, of which no two share a movable body: first the bundles of small islands, then those of bodies,
  /// none where bodies are few.
  std::size_t blocks() const { return ends_.size(); }
  std::size_t bundles() const { return islands_.bundles(); }
  /// The number, among the blocks of bodies where there are any, of that of a slot.
  static std::size_t blockOf(std::uint32_t slot) { return slot / blockSize; }
  /// The colours within a block.
  std::span<const Part> coloursOf(std::size_t block) const {
    const std::size_t first = block == 0 ? 0 : ends_[block - 1];
    return std::span<const Part>(inner_).subspan(first, ends_[block] - first);
  }
  std::size_t colours() const { return start_.size() - 2; }
  /// Rows [begin, end) of a colour but those within blocks; the colour `colours()` is the overflow.
  std::size_t begin(std::size_t colour) const { return start_[colour]; }
  std::size_t end(std::size_t colour) const { return start_[colour + 1]; }

  /// All rows, for passes over them in which contacts may share bodies.
  static constexpr std::size_t partSize = detail::RowParts::partSize;
  static constexpr std::size_t fewRows = detail::RowParts::fewRows;  ///< not worth the threads
  std::span<const Part> parts() const { return parts_.parts(); }
  /// How many parts are worth a task: all of them where threads share no group of rows.
  std::size_t partsOfTask() const { return parts_.ofTask(); }

  /// Body of each slot.
  std::span<const std::uint32_t> bodies() const { return slots_.bodies(); }
  std::uint32_t staticSlot() const { return slots_.staticSlot(); }
  bool movable(std::uint32_t slot) const { return slots_.movable()[slot] != 0; }
  /// Slot of a body; staticSlot() if it has none.
  std::uint32_t slotOf(std::uint32_t body) const { return slots_.of(body); }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  /// Groups: colours within blocks, other colours, and these.
  static constexpr std::uint8_t overflow = 2 * maxColours;
  static constexpr std::uint8_t lone = overflow + 1;
  static constexpr std::uint8_t inBundle = lone + 1;  ///< and above, by colour
  static constexpr std::uint8_t open = 255;           ///< not chosen yet
  static_assert(inBundle + maxColours < open);

  static constexpr std::size_t chunk = 8192;
  /// Slots of a block: the velocities of so many are a quarter of a megabyte in double.
  static constexpr std::uint32_t blockSize = 4096;
  static constexpr std::uint32_t fewBodies = 32768;  ///< not worth blocks

  /// Bodies in place of slots.
  template <Real S>
  void takeEnds(std::span<const Contact<S>> contacts, std::size_t bodies) {
    if (contacts.size() >= none) {
      detail::refuse("number of contacts", std::to_string(contacts.size()), "below 2^32 - 1");
    }
    detail::resizeSparingly(byContact_, contacts.size());
    parallelFor(contacts.size(), chunk, [&](std::size_t k) {
      detail::requireBodies(contacts[k], bodies);
      if (k > 0 && contacts[k].keys() < contacts[k - 1].keys()) {
        detail::refuse("place of a contact", std::to_string(k), "that in the order of keys");
      }
      byContact_[k] = {static_cast<std::uint32_t>(k), contacts[k].first, contacts[k].second};
    });
  }

  /// Of each contact its group, and how many of each group there are among those whose first bodies are of
  /// one block, which are neighbours in the list. Those within blocks find their colours block by block, and
  /// the others afterwards, as if there were no others.
  void choose() {
    detail::assignSparingly(used_, slots_.movable().size(), std::uint64_t{0});
    detail::resizeSparingly(group_, byContact_.size());
    places_.assign(blockOf(staticSlot()) + 1, Places{});
    bundled_.assign(bundles(), {});
    const bool inBlocks = staticSlot() > fewBodies;
    if (inBlocks) {
      parallelForTasks<Share::Alike>(places_.size(), [&](std::size_t block) { chooseWithin(block); });
      parallelFor(used_.size(), chunk, [&](std::size_t slot) { used_[slot] = 0; });
    }
    for (std::size_t k = 0; k < byContact_.size(); ++k) {
      if (inBlocks && group_[k] != open) {
        continue;
      }
      const Row& row = byContact_[k];
      Places& places = places_[blockOf(row.slot1)];
      if (isLone(row)) {
        group_[k] = lone;
        ++places[lone];
        continue;
      }
      const std::uint8_t colour = takeColour(row);
      group_[k] = overflow;
      const std::uint32_t island = islands_.numberOf(ofIsland(row));
      if (colour < maxColours && island != detail::SolverIslands::none) {
        group_[k] = static_cast<std::uint8_t>(inBundle + colour);
        ++bundled_[islands_.bundleOf(island)][colour];
        ++places[inBundle];
        continue;
      }
      if (colour < maxColours) {
        group_[k] = static_cast<std::uint8_t>(maxColours + colour);
      }
      ++places[group_[k]];
    }
    colours_ = 0;
    const auto count = [&](const auto& places, std::size_t first) {
      for (std::size_t colour = colours_; colour < maxColours; ++colour) {
        colours_ = places[first + colour] > 0 ? colour + 1 : colours_;
      }
    };
    for (const Places& places : places_) {
      count(places, 0);
      count(places, maxColours);
    }
    for (const auto& places : bundled_) {
      count(places, 0);
    }
  }

  /// The same of the contacts within a block; those of the others, and of small islands, stay `open`.
  void chooseWithin(std::size_t block) {
    const auto first = std::partition_point(byContact_.begin(), byContact_.end(),
                                            [&](const Row& row) { return blockOf(row.slot1) < block; });
    Places& places = places_[block];
    for (auto k = static_cast<std::size_t>(first - byContact_.begin());
         k < byContact_.size() && blockOf(byContact_[k].slot1) == block; ++k) {
      const Row& row = byContact_[k];
      group_[k] = open;
      if (isLone(row)) {
        group_[k] = lone;
        ++places[lone];
      } else if ((!movable(row.slot2) || blockOf(row.slot2) == block) &&
                 islands_.numberOf(ofIsland(row)) == detail::SolverIslands::none) {
        const std::uint8_t colour = takeColour(row);
        group_[k] = colour < maxColours ? colour : overflow;
        ++places[group_[k]];
      }
    }
  }

  bool isLone(const Row& row) const {
    return slots_.degree()[row.slot1] < 2 && slots_.degree()[row.slot2] < 2;
  }

  /// The first colour that neither body of a row has so far; maxColours if there is none.
  std::uint8_t takeColour(const Row& row) {
    constexpr std::uint64_t all = (std::uint64_t{1} << maxColours) - 1;
    const auto [contact, slot1, slot2] = row;
    const std::uint64_t free = ~(used_[slot1] | used_[slot2]) & all;
    if (free == 0) {
      return maxColours;
    }
    const auto colour = static_cast<std::uint8_t>(std::countr_zero(free));
    for (const std::uint32_t slot : {slot1, slot2}) {
      if (movable(slot)) {  // the others are shared between blocks
        used_[slot] |= std::uint64_t{1} << colour;
      }
    }
    return colour;
  }

  /// Rows by group, within one in the order of contacts.
  void arrange() {
    std::vector<std::size_t> first{0};  // contact of each block
    for (const Places& counts : places_) {
      first.push_back(std::accumulate(counts.begin(), counts.end(), first.back()));
    }
    std::size_t next = 0;
    const auto place = [&](std::size_t group) {
      for (Places& block : places_) {
        next += std::exchange(block[group], next);
      }
    };
    place(lone);
    loneCount_ = next;
    inner_.clear();
    ends_.clear();
    const auto placeBlock = [&](auto& block) {
      for (std::size_t colour = 0; colour < colours_; ++colour) {
        const auto begin = static_cast<std::uint32_t>(next);
        next += std::exchange(block[colour], next);
        if (next > begin) {
          inner_.push_back({begin, static_cast<std::uint32_t>(next)});
        }
      }
      ends_.push_back(inner_.size());
    };
    std::for_each(bundled_.begin(), bundled_.end(), placeBlock);
    islandsEnd_ = next;
    std::for_each(places_.begin(), places_.end(), placeBlock);
    if (next == islandsEnd_) {
      ends_.resize(bundles());
    }
    start_.assign(1, next);
    for (std::size_t colour = 0; colour < colours_; ++colour) {
      place(maxColours + colour);
      start_.push_back(next);
    }
    place(overflow);
    start_.push_back(next);
    detail::resizeSparingly(rows_, byContact_.size());
    parallelForTasks<Share::Alike>(places_.size(), [&](std::size_t block) {
      for (std::size_t k = first[block]; k < first[block + 1]; ++k) {
        if (group_[k] < inBundle) {
          rows_[places_[block][group_[k]]++] = byContact_[k];
        }
      }
    });
    detail::resizeSparingly(islandOfRow_, islandsEnd_ - loneCount_);
    for (std::size_t k = 0; k < byContact_.size() && !islandOfRow_.empty(); ++k) {
      if (group_[k] >= inBundle) {
        const Row& row = byContact_[k];
        const std::uint32_t island = islands_.numberOf(ofIsland(row));
        const std::size_t to = bundled_[islands_.bundleOf(island)][group_[k] - inBundle]++;
        rows_[to] = row;
        islandOfRow_[to - loneCount_] = island;
      }
    }
    cut();
  }

  /// The parts.
  void cut() {
    parts_.begin();
    parts_.addGroup(0, loneCount());
    parts_.addGroup(loneCount(), islandsEnd());
    const std::size_t first = bundles() == 0 ? 0 : ends_[bundles() - 1];
    for (const Part& colour : std::span<const Part>(inner_).subspan(first)) {
      parts_.add(colour, islandsEnd(), start_.front(), true);
    }
    for (std::size_t colour = 0; colour < colours(); ++colour) {
      parts_.addGroup(begin(colour), end(colour));
    }
    parts_.addGroup(begin(colours()), end(colours()), false);
    parts_.end();
  }

  std::vector<Row> rows_;
  detail::RowParts parts_;
  detail::SolverIslands islands_;
  std::size_t islandsEnd_ = 0;
  std::vector<std::uint32_t> islandOfRow_;  ///< from the first one of small islands on
  using Places = std::array<std::size_t, 2 * maxColours + 3>;
  std::vector<Places> places_;  ///< by block of first bodies, of its next row in each group
  std::size_t loneCount_ = 0;
  std::vector<Part> inner_;                                   ///< rows of the colours of blocks
  std::vector<std::size_t> ends_;                             ///< by block, there
  std::vector<std::array<std::size_t, maxColours>> bundled_;  ///< by bundle, of its next row in each colour
  std::size_t colours_ = 0;
  std::vector<std::size_t> start_{0, 0};
  detail::ContactSlots slots_;
  // While it is built:
  std::vector<Row> byContact_;
  std::vector<std::uint8_t> group_;
  std::vector<std::uint64_t> used_;
};

}  // namespace gravel
