#pragma once

/// \file
/// An order in which contacts can be solved at once: no two contacts of one colour share a movable body.

#include <gravel/contact/contact_facts.hpp>
#include <gravel/core/check.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gravel {

/// Colours of the contacts, greedily in the order of the list, which is that of the keys: a function of ids
/// alone. Fixed bodies and boundaries take part in any number of contacts of a colour. Contacts that find no
/// colour among 62 (of a body with very many partners) go to an overflow group that is solved serially.
/// Contacts that share no movable body with any other make up a group of their own, the lone ones, which are
/// exact after one blow. Keeps most of its workspace; O(contacts), with a sort of those bodies that are first
/// in no contact, and O(bodies) once for the largest number of them.
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
  /// \throws std::invalid_argument for a contact of a body that is not there, or of a body with itself
  template <Real S, ContactBodies B>
  void build(std::span<const Contact<S>> contacts, const B& bodies) {
    takeEnds(contacts, bodies.size());
    number(bodies);
    choose();
    arrange();
  }

  /// Rows in the order of solving: lone ones, colour 0, 1, …, overflow.
  std::span<const Row> rows() const { return rows_; }
  std::size_t loneCount() const { return start_.front(); }
  std::size_t colours() const { return start_.size() - 2; }
  /// The same rows in the order of contacts.
  std::span<const Row> rowsByContact() const { return byContact_; }
  /// Rows [begin, end) of a colour; the colour `colours()` is the overflow.
  std::size_t begin(std::size_t colour) const { return start_[colour]; }
  std::size_t end(std::size_t colour) const { return start_[colour + 1]; }

  /// All rows, for passes over them in which contacts may share bodies: parts of up to `partSize` rows of one
  /// group (a colour, the lone ones, the overflow), those first that stand first in their groups. So a thread
  /// that takes its share of the parts has about the rows, and the bodies, that it has when colours are
  /// shared between threads one by one, and they stay in its cache.
  struct Part {
    std::uint32_t begin;
    std::uint32_t end;
  };
  static constexpr std::size_t partSize = 128;
  static constexpr std::size_t fewRows = 4 * partSize;  ///< not worth the threads
  std::span<const Part> parts() const { return parts_; }
  /// How many parts are worth a task: all of them where threads share no group of rows.
  std::size_t partsOfTask() const { return shared_ ? 1 : std::max<std::size_t>(1, parts_.size()); }

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
  static constexpr std::uint8_t overflow = maxColours;
  static constexpr std::uint8_t lone = maxColours + 1;

  static constexpr std::size_t chunk = 8192;

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

  void choose() {
    constexpr std::uint64_t all = (std::uint64_t{1} << maxColours) - 1;
    used_.assign(movable_.size(), 0);
    detail::resizeSparingly(colour_, byContact_.size());
    for (std::size_t k = 0; k < byContact_.size(); ++k) {
      Row& row = byContact_[k];
      if (degree_[row.slot1] <= 1 && degree_[row.slot2] <= 1) {
        colour_[k] = lone;
        continue;
      }
      const std::uint64_t taken = used_[row.slot1] | used_[row.slot2];
      const std::uint64_t free = ~taken & all;
      if (free == 0) {
        colour_[k] = overflow;
        continue;
      }
      const std::uint64_t bit = free & (~free + 1);
      colour_[k] = static_cast<std::uint8_t>(std::countr_zero(bit));
      used_[row.slot1] |= movable_[row.slot1] != 0 ? bit : 0;
      used_[row.slot2] |= movable_[row.slot2] != 0 ? bit : 0;
    }
  }

  /// By colour, within one in the order of contacts: first how many there are in each part of the list, then
  /// each part finds its places.
  void arrange() {
    const std::size_t n = byContact_.size();
    places_.assign(n / chunk + 1, Places{});
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        ++places_[begin / chunk][colour_[k]];
      }
    });
    std::size_t next = 0;
    const auto place = [&](std::uint8_t colour) {
      for (Places& part : places_) {
        next += std::exchange(part[colour], next);
      }
    };
    place(lone);
    start_.assign(1, next);
    for (std::uint8_t c = 0; c < maxColours; ++c) {
      place(c);
      if (next == start_.back()) {
        break;  // greedy colours leave no gaps
      }
      start_.push_back(next);
    }
    place(overflow);
    start_.push_back(n);
    detail::resizeSparingly(rows_, n);
    parallelForChunks<Share::Alike>(n, chunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        rows_[places_[begin / chunk][colour_[k]]++] = byContact_[k];
      }
    });
    cut();
  }

  /// The parts.
  void cut() {
    parts_.clear();
    shared_ = false;
    std::vector<std::pair<double, Part>> all;  // with where its middle stands in its group, 0 … 1
    const auto add = [&](std::size_t begin, std::size_t end, bool serial) {
      const std::size_t rows = end - begin;
      const detail::Chunks chunks(rows, partSize);
      const bool isShared = rows >= fewRows && !serial;
      shared_ = shared_ || isShared;
      for (std::size_t c = 0; c < chunks.count(); ++c) {
        const std::size_t middle = chunks.begin(c) + chunks.end(c);
        // Groups that are not shared are the calling thread's: it begins with them.
        const double place = isShared ? static_cast<double>(middle) / static_cast<double>(2 * rows) : 0.0;
        all.push_back({place,
                       {static_cast<std::uint32_t>(begin + chunks.begin(c)),
                        static_cast<std::uint32_t>(begin + chunks.end(c))}});
      }
    };
    add(0, loneCount(), false);
    for (std::size_t colour = 0; colour <= colours(); ++colour) {
      add(begin(colour), end(colour), colour == colours());
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& part : all) {
      parts_.push_back(part.second);
    }
  }

  std::vector<Row> rows_;
  std::vector<Row> byContact_;
  std::vector<Part> parts_;
  bool shared_ = false;  ///< any group is shared between threads
  using Places = std::array<std::size_t, maxColours + 2>;
  std::vector<Places> places_;  ///< by part of the list
  std::vector<std::size_t> start_{0, 0};
  std::vector<std::uint32_t> bodyOfSlot_;
  std::vector<std::uint32_t> slotOfBody_;
  std::vector<std::uint32_t> degree_;
  std::vector<std::uint8_t> movable_;
  std::vector<std::uint8_t> colour_;
  std::vector<std::uint64_t> used_;
};

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

/// As sumOverParts() over all rows but the lone ones, colour after colour, and the overflow one by one.
template <class T, class F>
T sumOverColourParts(const ContactColoring& colouring, const T& zero, F&& f) {
  T sum = zero;
  for (std::size_t c = 0; c < colouring.colours(); ++c) {
    sum += sumOverParts(colouring.begin(c), colouring.end(c), zero, f);
  }
  const std::size_t overflow = colouring.colours();
  for (std::size_t k = colouring.begin(overflow); k < colouring.end(overflow); ++k) {
    f(k, k + 1, sum);
  }
  return sum;
}

}  // namespace detail

}  // namespace gravel
