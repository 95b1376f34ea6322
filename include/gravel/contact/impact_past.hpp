#pragma once

/// \file
/// What each body has been through in a step, by the impacts that were dealt in it.

#include <gravel/contact/collision_outcome.hpp>
#include <gravel/contact/contact_islands.hpp>
#include <gravel/contact/impact_histories.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace gravel::detail {

template <Real S>
class ImpactPast {
 protected:
  static constexpr std::size_t noPair = std::numeric_limits<std::size_t>::max();
  enum class Listed : unsigned char { Unknown, No, Yes };
  /// How the impacts of a pair came to an end in the step: it was brought to rest, or somebody else said so.
  enum class Ending : unsigned char { None, Rest, Decided, Merge };

  /// A new step: nothing has happened.
  void forget() {
    histories_.forget();
    struck_.clear();
    islandsKnown_ = false;
    clearSpare(impacts_);
    forgetEndings();
    merges_.clear();
    cleared_ = true;
  }
  /// All blows of the step are dealt: what nobody else looks at.
  void end() {
    giveBack(leans_);
    giveBack(listed_);
    giveBack(anchored_);
    giveBack(struck_);
    islands_ = {};
    forgetEndings();
  }

  /// For the impacts of so many bodies, of which so many pairs may meet.
  void prepare(std::size_t count, std::size_t pairs, std::span<const ContactName> held) {
    histories_.resize(count);
    listed_.assign(pairs, Listed::Unknown);
    leans_.assign(count, 0);
    for (const ContactName& c : held) {
      leans_[c.first] = 1;
      if (c.second != staticPartner) {
        leans_[c.second] = 1;
      }
    }
  }

  /// Whether what is held hangs together, from body to body, with a boundary or with a body that does not
  /// move. O(bodies + held) the first time in a step.
  template <class Scene>
  bool isAnchored(const Scene& scene, std::uint32_t body) {
    if (!islandsKnown_) {
      islands_.find(scene.held, scene.bodies);
      anchored_.assign(scene.bodies.size(), 0);
      for (const ContactName& c : scene.held) {
        if (c.second == staticPartner || !isMovable(scene.bodies, c.second)) {
          anchored_[islands_.of(c.first)] = 1;
        } else if (!isMovable(scene.bodies, c.first)) {
          anchored_[islands_.of(c.second)] = 1;
        }
      }
      islandsKnown_ = true;
    }
    return anchored_[islands_.of(body)] != 0;
  }

  static bool isListed(std::span<const ContactName> names, const ContactKeys& keys) {
    const auto found = placeOf(names, keys);
    return found != names.end() && found->keys == keys;
  }

  /// The same for pair number `pair` of the candidates: looked up once in a step. Pairs that came in it have
  /// no number.
  bool isListed(std::span<const ContactName> names, const ContactKeys& keys, std::size_t pair) {
    if (pair >= listed_.size()) {
      return isListed(names, keys);
    }
    Listed& known = listed_[pair];
    if (known == Listed::Unknown) {
      known = isListed(names, keys) ? Listed::Yes : Listed::No;
    }
    return known == Listed::Yes;
  }

  /// Whether somebody else has given the pair velocities in this step, with which they do not part.
  bool isDecided(std::uint32_t first, std::uint64_t key2) const {
    return endingOf(first, key2) == Ending::Decided;
  }
  /// Whether somebody else lets the two merge.
  bool isToMerge(std::uint32_t first, std::uint64_t key2) const {
    return endingOf(first, key2) == Ending::Merge;
  }

  Ending endingOf(std::uint32_t first, std::uint64_t key2) const {
    if (!histories_.of(first).ends) {
      return Ending::None;
    }
    const auto found = endings_.find({first, key2});
    return found == endings_.end() ? Ending::None : found->second;
  }

  /// Brought to rest in this step, or decided so about.
  bool isAtRest(std::uint32_t first, std::uint64_t key2) const {
    return endingOf(first, key2) != Ending::None;
  }

  /// Solved together with others, and neither was let go since; or brought to rest in this step.
  /// \param pair  its number among the candidates, if it is one
  template <class Scene>
  bool isHeld(const Scene& scene, std::uint32_t first, std::uint32_t second, const ContactKeys& keys,
              std::size_t pair = noPair) {
    if (isAtRest(first, keys.second)) {
      return true;
    }
    return !scene.isFree(first) && !(second != staticPartner && scene.isFree(second)) &&
           isListed(scene.held, keys, pair);
  }

  /// It does not bounce any more.
  template <class Scene>
  bool bouncesNoMore(const Scene& scene, std::uint32_t body) const {
    return histories_.of(body).spent >= S(scene.settings.mostPerBody);
  }
  /// Whether a body that is left to the solver of simultaneous contacts takes no notice of another one. What
  /// it hardly moves stops it still: a boundary, what is fixed or much heavier, but of those that it has met
  /// the heaviest alone, or it would bounce between two. So a grain stays on its planet, whatever presses it
  /// on.
  template <class Scene>
  bool passes(const Scene& scene, std::uint32_t body, std::uint32_t other) const {
    const ImpactHistory<S>& past = histories_.of(body);
    const S most = S(scene.settings.mostAfter);
    if (!(past.after >= most)) {
      return false;
    }
    const S its = weightOf(scene.bodies, other);
    return past.after >= S(2) * most || its < past.heaviest || its / S(8) < S(scene.bodies.masses()[body]);
  }

  /// The mass of a body, for comparisons: no finite one of what nothing moves.
  template <class B>
  static S weightOf(const B& bodies, std::uint32_t body) {
    return body == staticPartner || !isMovable(bodies, body) ? highest<S>() : S(bodies.masses()[body]);
  }

  /// Enters the last impact. \param ends  the two take no notice of each other any more in this step
  template <class Scene>
  void remember(const Scene& scene, const S& e, ImpactReport<S>& report, bool ends = false) {
    const Impact<S>& impact = impacts_.back();
    const auto enter = [&](std::uint32_t body, std::uint32_t other, std::uint64_t partner) {
      ImpactHistory<S>& past = histories_.at(body);
      const bool before = bouncesNoMore(scene, body);
      // The lighter one of two pays, or both of equal mass. A large body may be struck by any number of
      // grains in a step, and its own partner is the one that it pays for: a floor that they drive it
      // against. One of the two always pays, so that there are no more impacts in a step than bodies times
      // those that use up all that one has, 8 * 512 + 2 * 64.
      const S its = weightOf(scene.bodies, other);
      const S charge = isMovable(scene.bodies, body) && !(its < S(scene.bodies.masses()[body])) ? S(1) : S(0);
      const S least = S(1) / S(512);
      past.after += before ? charge : S(0);
      past.spent += charge * (past.impacts > 0 && past.partner == partner ? least : S(S(1) - e + least));
      past.partner = charge > S(0) ? partner : past.partner;
      past.heaviest = std::max<S>(past.heaviest, its);
      past.impacts += isMovable(scene.bodies, body) ? 1U : 0U;  // or what is foreseen of it holds on
      report.postponed += bouncesNoMore(scene, body) && !before ? 1U : 0U;
    };
    enter(impact.first, impact.second, impact.key2);
    if (impact.second != staticPartner) {
      enter(impact.second, impact.first, impact.key1);
    }
    if (ends || impact.rests) {
      histories_.at(impact.first).ends = true;
      Ending& ending = endings_[{impact.first, impact.key2}];
      if (impact.decided) {
        ending = impact.rests ? Ending::Decided : Ending::Merge;
      } else if (ending == Ending::None) {
        ending = Ending::Rest;
      }
    }
  }

  /// With their room: to clear it takes as long as it is large.
  void forgetEndings() {
    if (!endings_.empty()) {
      endings_ = decltype(endings_)();
    }
  }

  /// The first body of a pair and the id of the second one.
  struct PairName {
    std::uint32_t first;
    std::uint64_t key2;
    bool operator==(const PairName&) const = default;
  };
  struct HashOfPair {
    std::size_t operator()(const PairName& pair) const noexcept {
      return static_cast<std::size_t>(
          (pair.key2 ^ (std::uint64_t{pair.first} << 32U)) * 0x9E3779B97F4A7C15U >> 8U);
    }
  };

  bool cleared_ = false;  ///< since the last blow
  ImpactHistories<S> histories_;
  std::vector<unsigned char> leans_;     ///< bodies with a contact that is held
  std::vector<Listed> listed_;           ///< among what is held, by pair
  ContactIslands islands_;               ///< of what is held
  std::vector<unsigned char> anchored_;  ///< by the body that an island is named by
  bool islandsKnown_ = false;
  std::vector<std::uint32_t> struck_;  ///< by the blows of this moment
  std::vector<Impact<S>> impacts_;
  std::unordered_map<PairName, Ending, HashOfPair> endings_;  ///< of pairs that had one
  BodyPairs merges_;
};

}  // namespace gravel::detail
