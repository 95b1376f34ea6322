#pragma once

/// \file
/// An order in which contacts can be solved at once: no two contacts of one colour share a movable body.

#include <gravel/contact/contact_facts.hpp>
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

/// Colours of the contacts, greedily in the order of the list, which is that of the keys: a function of ids
/// alone. Fixed bodies and boundaries take part in any number of contacts of a colour. Contacts that find no
/// colour among 62 (of a body with very many partners) go to an overflow group that is solved serially.
/// Contacts that share no movable body with any other make up a group of their own, the lone ones, which are
/// exact after one blow. Of more bodies than caches hold, contacts within a block of bodies whose ids follow
/// each other come block by block, and in each colour by colour, before the contacts between blocks: bodies
/// are fetched once in place of once a colour, and blocks are solved at once.
/// O(contacts), with a sort of those bodies that are first in no contact, and O(bodies) once for the largest
/// number of them.
class ContactColoring {
 public:
  static constexpr std::size_t maxColours = 62;

  /// Slots: the bodies that take part, numbered from 0 in the order of ids; the last one, `staticSlot()`,
  /// stands for boundaries.
  struct Row {
    std::uint32_t contact;  ///< index in the list
    std::uint32_t slot1;
    std::uint32_t slot2;
  };

  /// \param contacts sorted by keys, which are the ids of the bodies
  /// \throws std::invalid_argument for a contact of a body that is not there, or of a body with itself, or
  /// out of order
  template <Real S, ContactBodies B>
  void build(std::span<const Contact<S>> contacts, const B& bodies) {
    takeEnds(contacts, bodies.size());
    number(bodies);
    islands_.find(std::span<const Row>(byContact_), movable_);
    islands_.bundle(std::span<const Row>(byContact_), degree_, maxColours);
    choose();
    arrange();
    islands_.forgetNumbers();
    detail::giveBack(byContact_);
    detail::giveBack(degree_);
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
  std::uint32_t ofIsland(const Row& row) const { return movable_[row.slot1] != 0 ? row.slot1 : row.slot2; }
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
  std::span<const std::uint32_t> bodies() const { return bodyOfSlot_; }
  std::uint32_t staticSlot() const { return static_cast<std::uint32_t>(bodyOfSlot_.size()); }
  bool movable(std::uint32_t slot) const { return movable_[slot] != 0; }
  /// Slot of a body; staticSlot() if it has none.
  std::uint32_t slotOf(std::uint32_t body) const {
    const std::uint32_t slot = body < slotOfBody_.size() ? slotOfBody_[body] : none;
    return slot == none ? staticSlot() : slot;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  /// Groups: colours within blocks, other colours, and these.
  static constexpr std::uint8_t overflow = 2 * maxColours;
  static constexpr std::uint8_t lone = overflow + 1;
  static constexpr std::uint8_t inBundle = lone + 1;  ///< and above, by colour

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
      byContact_[k] = {static_cast<std::uint32_t>(k), contacts[k].first, contacts[k].second};
    });
  }

  /// Slots in the order of ids. Contacts come in the order of their first keys, so that only those bodies
  /// that are first in none need to be sorted.
  template <ContactBodies B>
  void number(const B& bodies) {
    for (const std::uint32_t body : bodyOfSlot_) {
      slotOfBody_[body] = none;
    }
    slotOfBody_.resize(std::max(slotOfBody_.size(), bodies.size()), none);
    bodyOfSlot_.clear();
    bodyOfSlot_.reserve(bodies.size());
    const auto take = [&](std::uint32_t body) {
      if (slotOfBody_[body] == none) {
        slotOfBody_[body] = 0;
        bodyOfSlot_.push_back(body);
      }
    };
    for (const Row& row : byContact_) {
      take(row.slot1);
    }
    const auto firsts = static_cast<std::ptrdiff_t>(bodyOfSlot_.size());
    for (const Row& row : byContact_) {
      if (row.slot2 != staticPartner) {
        take(row.slot2);
      }
    }
    auto&& ids = bodies.ids();
    const auto before = [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; };
    std::sort(bodyOfSlot_.begin() + firsts, bodyOfSlot_.end(), before);
    std::inplace_merge(bodyOfSlot_.begin(), bodyOfSlot_.begin() + firsts, bodyOfSlot_.end(), before);
    movable_.clear();
    movable_.reserve(staticSlot() + 1);
    for (std::uint32_t slot = 0; slot < staticSlot(); ++slot) {
      slotOfBody_[bodyOfSlot_[slot]] = slot;
      movable_.push_back(detail::isMovable(bodies, bodyOfSlot_[slot]) ? 1 : 0);
    }
    movable_.push_back(0);
    degree_.assign(movable_.size(), 0);
    for (Row& row : byContact_) {
      row.slot1 = slotOfBody_[row.slot1];
      row.slot2 = row.slot2 == staticPartner ? staticSlot() : slotOfBody_[row.slot2];
      degree_[row.slot1] += movable_[row.slot1];
      degree_[row.slot2] += movable_[row.slot2];
    }
  }

  /// Of each contact its group, and how many of each group there are among those whose first bodies are of
  /// one block, which are neighbours in the list.
  void choose() {
    constexpr std::uint64_t all = (std::uint64_t{1} << maxColours) - 1;
    used_.assign(movable_.size(), 0);
    detail::resizeSparingly(group_, byContact_.size());
    places_.assign(blockOf(staticSlot()) + 1, Places{});
    bundled_.assign(bundles(), {});
    colours_ = 0;
    const bool inBlocks = staticSlot() > fewBodies;
    for (std::size_t k = 0; k < byContact_.size(); ++k) {
      const auto [contact, slot1, slot2] = byContact_[k];
      if (k > 0 && slot1 < byContact_[k - 1].slot1) {
        detail::refuse("place of a contact", std::to_string(k), "that in the order of keys");
      }
      const std::size_t block = blockOf(slot1);
      group_[k] = lone;
      if (degree_[slot1] > 1 || degree_[slot2] > 1) {
        const std::uint64_t free = ~(used_[slot1] | used_[slot2]) & all;
        group_[k] = overflow;
        if (free != 0) {
          const auto colour = static_cast<std::uint8_t>(std::countr_zero(free));
          colours_ = std::max<std::size_t>(colours_, colour + 1U);
          used_[slot1] |= std::uint64_t{movable_[slot1]} << colour;
          used_[slot2] |= std::uint64_t{movable_[slot2]} << colour;
          const std::uint32_t island = islands_.numberOf(ofIsland(byContact_[k]));
          if (island != detail::SolverIslands::none) {
            group_[k] = static_cast<std::uint8_t>(inBundle + colour);
            ++bundled_[islands_.bundleOf(island)][colour];
            ++places_[block][inBundle];
            continue;
          }
          const bool within = inBlocks && (movable_[slot2] == 0 || blockOf(slot2) == block);
          group_[k] = static_cast<std::uint8_t>(within ? colour : maxColours + colour);
        }
      }
      ++places_[block][group_[k]];
    }
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
  std::vector<std::uint32_t> bodyOfSlot_;
  std::vector<std::uint32_t> slotOfBody_;
  std::vector<std::uint8_t> movable_;
  // While it is built:
  std::vector<Row> byContact_;
  std::vector<std::uint32_t> degree_;
  std::vector<std::uint8_t> group_;
  std::vector<std::uint64_t> used_;
};

}  // namespace gravel
