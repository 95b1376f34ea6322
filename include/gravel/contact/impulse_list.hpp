#pragma once

/// \file
/// The impulses of many contacts, in little room.

#include <gravel/contact/contact_settings.hpp>
#include <gravel/contact/row_lanes.hpp>
#include <gravel/core/memory.hpp>
#include <gravel/core/parallel.hpp>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace gravel::detail {

/// Impulses by number; those against rolling and spinning take room only where there are such. Different
/// numbers may be written at the same time.
template <Real S>
class ImpulseList {
 public:
  std::size_t size() const { return pushes_.size(); }

  /// As many, of any value; what is there stays if it is as many. \param turns whether any of them resists
  /// rolling or spinning: none so far, if none did
  void resize(std::size_t count, bool turns) {
    resizeSparingly(pushes_, count);
    resizeSparingly(impacts_, count);
    if (!turns) {
      release(turning_);
    } else if (turning_.size() != count) {
      turning_.assign(count, Turn{});
    }
  }

  /// As many, all zero.
  void clear(std::size_t count) {
    pushes_.assign(count, Push{});
    impacts_.assign(count, 0);
    turning_.clear();
  }

  bool turns() const { return !turning_.empty(); }
  /// Whether any contact carries a load.
  bool any() const {
    return std::any_of(pushes_.begin(), pushes_.end(), [](const Push& push) { return push.normal > S(0); });
  }
  const S& normal(std::size_t k) const { return pushes_[k].normal; }
  const Vector3<S>& tangential(std::size_t k) const { return pushes_[k].tangential; }
  Vector3<S> turning(std::size_t k) const {
    return turning_.empty() ? Vector3<S>(Vector3<S>::Zero()) : turning_[k].l;
  }

  bool isImpact(std::size_t k) const { return impacts_[k] != 0; }
  ContactImpulse<S> get(std::size_t k) const {
    return {pushes_[k].normal, pushes_[k].tangential, turning(k), impacts_[k] != 0};
  }

  /// What resists turning is left out unless the list turns().
  void set(std::size_t k, const ContactImpulse<S>& j) {
    pushes_[k] = {j.tangential, j.normal};
    impacts_[k] = j.impact ? 1 : 0;
    if (!turning_.empty()) {
      turning_[k].l = j.turning;
    }
  }

  /// Tangential and normal one of a row: four scalars.
  const S* quad(std::size_t k) const { return quadOf<S>(pushes_[k], 0); }
  /// To the rows of a group those of them in listOf(k). \param turns  these lists do
  template <class ListOf>
  [[gnu::always_inline]] static inline void load(const RowGroup<S>& group, RowLanes<S>& row, bool turns,
                                                 ListOf&& listOf) {
    const auto push =
        PackedQuad<S>::load([&](std::size_t lane) { return listOf(group.row[lane]).quad(group.row[lane]); });
    row.jt = PackedVector<S>::of(push);
    row.jn = push.w;
    row.l = PackedVector<S>::zero();
    if (turns) {
      row.l = PackedVector<S>::of(PackedQuad<S>::load(
          [&](std::size_t lane) { return quadOf<S>(listOf(group.row[lane]).turning_[group.row[lane]], 0); }));
    }
  }
  /// Those of these rows put here; what else they have is set by itself.
  [[gnu::always_inline]] inline void store(const RowGroup<S>& group, const RowLanes<S>& row) {
    const auto put = [&](auto& quads, const PackedQuad<S>& quad) {
      quad.store([&](std::size_t lane) { return quadOf<S>(quads[group.row[lane]], 0); },
                 [&](std::size_t lane) { return group.holds(lane); });
    };
    put(pushes_, {row.jt.x, row.jt.y, row.jt.z, row.jn});
    if (turns()) {
      put(turning_, {row.l.x, row.l.y, row.l.z, Packed<S>::zero()});
    }
  }
  void setPush(std::size_t k, const S& normal, const Vector3<S>& tangential) {
    pushes_[k] = {tangential, normal};
  }
  void scale(std::size_t k, const S& factor) {
    pushes_[k].normal *= factor;
    pushes_[k].tangential *= factor;
    if (!turning_.empty()) {
      turning_[k].l *= factor;
    }
  }
  void setImpact(std::size_t k, bool impact) { impacts_[k] = impact ? 1 : 0; }

  /// All, entry placeOf(k) as the k-th.
  template <class PlaceOf>
  std::vector<ContactImpulse<S>> listed(PlaceOf&& placeOf) const {
    std::vector<ContactImpulse<S>> all(size());
    parallelFor(size(), chunk, [&](std::size_t k) { all[k] = get(placeOf(k)); });
    return all;
  }

 private:
  static constexpr std::size_t chunk = 512;

  struct Push {  // a quad of scalars
    Vector3<S> tangential = Vector3<S>::Zero();
    S normal = S(0);
  };

  struct Turn {  // so is this
    Vector3<S> l = Vector3<S>::Zero();
    S none = S(0);
  };

  std::vector<Push> pushes_;
  std::vector<std::uint8_t> impacts_;
  std::vector<Turn> turning_;  ///< empty where nothing turns
};

}  // namespace gravel::detail
