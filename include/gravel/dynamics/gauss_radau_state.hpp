#pragma once

/// \file
/// What the Gauss-Radau method knows from one step to the next.

#include <gravel/bodies/bodies.hpp>
#include <gravel/core/sizes.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace gravel::detail {

/// Three rows a body: x, y, z.
template <Real Scalar>
struct RadauState {
  static constexpr std::size_t nodes = 7;
  using Column = Eigen::Array<Scalar, Eigen::Dynamic, 1>;
  using Columns = std::array<Column, nodes>;

  Column x, v;                    ///< where the last step left the bodies
  Column xLow, vLow;              ///< their lost parts
  Columns b, e;                   ///< coefficients of the last step, as found and as predicted
  Scalar next = Scalar(0);        ///< [s] that the last step asks for
  Scalar step = Scalar(0);        ///< [s] of the last step; 0: there is none
  Scalar fixedPlace = Scalar(0);  ///< [m] the largest coordinate of fixed bodies

  static void clear(Columns& columns) {
    for (Column& c : columns) {
      c.setConstant(Scalar(0));
    }
  }

  /// Of `bodies`. If they are not where the last step left them, that step's knowledge is void.
  template <class Layout>
  void read(const Bodies<Scalar, Layout>& bodies) {
    const auto rows = static_cast<Eigen::Index>(3 * bodies.size());
    bool same = x.size() == rows;
    if (!same) {
      resize(rows);
    }
    const auto compare = [&same](auto&& seen, auto&& low, const Vector3<Scalar>& now) {
      if (!(seen == now.array()).all()) {
        low.setConstant(Scalar(0));
        same = false;
      }
      seen = now.array();
    };
    fixedPlace = Scalar(0);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (bodies[i].isFixed()) {
        fixedPlace =
            std::max<Scalar>(fixedPlace, detail::maxAbs<Scalar>(Vector3<Scalar>(bodies.positions()[i])));
      }
      const auto at = static_cast<Eigen::Index>(3 * i);
      compare(x.template segment<3>(at), xLow.template segment<3>(at), bodies.positions()[i]);
      compare(v.template segment<3>(at), vLow.template segment<3>(at), bodies[i].countingVelocity());
    }
    if (!same) {
      next = step = Scalar(0);
      clear(b);
      clear(e);
    }
  }

  std::vector<Scalar> numbers() const {
    std::vector<Scalar> all;
    if (x.size() > 0) {
      all = {next, step};
      eachColumn(*this, [&](const Column& c) { all.insert(all.end(), c.data(), c.data() + c.size()); });
    }
    return all;
  }

  /// Takes up numbers(). \return false, and is empty, if they are none
  bool take(const std::vector<Scalar>& all) {
    *this = RadauState();
    constexpr std::size_t columns = 4 + 2 * nodes;
    if (all.empty()) {
      return true;
    }
    if (all.size() < 2 || (all.size() - 2) % (3 * columns) != 0) {
      return false;
    }
    resize(static_cast<Eigen::Index>((all.size() - 2) / columns));
    next = all[0];
    step = all[1];
    const Scalar* from = all.data() + 2;
    eachColumn(*this, [&](Column& c) {
      std::copy(from, from + c.size(), c.data());
      from += c.size();
    });
    return true;
  }

 private:
  template <class Self, class Visit>
  static void eachColumn(Self& self, Visit&& visit) {
    for (auto* c : {&self.x, &self.v, &self.xLow, &self.vLow}) {
      visit(*c);
    }
    for (auto* all : {&self.b, &self.e}) {
      for (auto& c : *all) {
        visit(c);
      }
    }
  }

  void resize(Eigen::Index rows) {
    eachColumn(*this, [&](Column& c) { c.setConstant(rows, Scalar(0)); });
  }
};

}  // namespace gravel::detail
