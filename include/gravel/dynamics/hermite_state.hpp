#pragma once

/// \file
/// What Hermite's method knows from one step to the next.

#include <gravel/bodies/bodies.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace gravel::detail {

/// Bodies in rows of columns, those with mass first, each kind in the order of the bodies.
template <Real Scalar>
struct HermiteState {
  using Column = Eigen::Array<Scalar, Eigen::Dynamic, 1>;
  using Columns = std::array<Column, 3>;
  using Level = std::uint8_t;

  Columns x, v, a, j;  ///< at the start of each row's step; v of fixed bodies is zero
  Column m;
  Column wanted;                       ///< [s] the step that each row asks for
  std::vector<Level> level;            ///< the step it has is h 2^-level
  std::vector<std::uint32_t> movable;  ///< rows
  std::size_t sources = 0;             ///< rows with mass

  /// Of `bodies`, of which nothing is known from here on until remember(): who throws on the way leaves rows
  /// at several times. \return true if they are as they were left, false if all but places, velocities and
  /// masses is to be found anew
  template <class Layout>
  bool read(const Bodies<Scalar, Layout>& bodies) {
    const std::size_t n = bodies.size();
    const bool known = isLeftAs(bodies);
    left_.clear();
    if (known) {
      return true;
    }
    order(bodies);
    const auto rows = static_cast<Eigen::Index>(n);
    for (Columns* columns : {&x, &v, &a, &j}) {
      for (Column& c : *columns) {
        c.setConstant(rows, Scalar(0));
      }
    }
    wanted.setConstant(rows, Scalar(0));
    for (std::size_t row = 0; row < n; ++row) {
      const auto at = static_cast<Eigen::Index>(row);
      const auto body = bodies[bodyOf_[row]];
      const Vector3<Scalar> place = body.position();
      const Vector3<Scalar> speed =
          body.isFixed() ? Vector3<Scalar>::Zero().eval() : Vector3<Scalar>(body.velocity());
      for (std::size_t c = 0; c < 3; ++c) {
        x[c][at] = place[static_cast<Eigen::Index>(c)];
        v[c][at] = speed[static_cast<Eigen::Index>(c)];
      }
    }
    return false;
  }

  template <class Layout>
  void write(Bodies<Scalar, Layout>& bodies) const {
    for (const std::uint32_t row : movable) {
      const auto body = bodies[bodyOf_[row]];
      body.position() = Vector3<Scalar>(x[0][row], x[1][row], x[2][row]);
      body.velocity() = Vector3<Scalar>(v[0][row], v[1][row], v[2][row]);
    }
  }

  /// How the bodies are left.
  template <class Layout>
  void remember(const Bodies<Scalar, Layout>& bodies) {
    left_.clear();
    left_.reserve(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      left_.emplace_back(bodies, i);
    }
  }

  /// Seven a body: a, j and the step wanted; none if nothing is known of these bodies as they are now.
  template <class Layout>
  std::vector<Scalar> numbers(const Bodies<Scalar, Layout>& bodies) const {
    std::vector<Scalar> all;
    if (isLeftAs(bodies)) {
      eachColumn(*this, [&](const Column& c) { all.insert(all.end(), c.data(), c.data() + c.size()); });
    }
    return all;
  }

  /// Whether these are the bodies of remember(), and nobody has changed them since.
  template <class Layout>
  bool isLeftAs(const Bodies<Scalar, Layout>& bodies) const {
    bool same = left_.size() == bodies.size();
    for (std::size_t i = 0; same && i < left_.size(); ++i) {
      same = left_[i] == Left(bodies, i);
    }
    return same;
  }

  /// Takes up numbers() of these bodies. \return false, and is empty, if they are none
  template <class Layout>
  bool take(const Bodies<Scalar, Layout>& bodies, const std::vector<Scalar>& all) {
    *this = HermiteState();
    if (all.empty() || all.size() != 7 * bodies.size()) {
      return all.empty();
    }
    read(bodies);
    const Scalar* from = all.data();
    eachColumn(*this, [&](Column& c) {
      std::copy(from, from + c.size(), c.data());
      from += c.size();
    });
    remember(bodies);
    return true;
  }

 private:
  /// All of a body that its motion depends on.
  struct Left {
    Vector3<Scalar> x, v, a;
    Scalar m;
    bool fixed;

    template <class Layout>
    Left(const Bodies<Scalar, Layout>& bodies, std::size_t i)
        : x(bodies[i].position()),
          v(bodies[i].velocity()),
          a(bodies[i].acceleration()),
          m(bodies[i].mass()),
          fixed(bodies[i].isFixed()) {}
    bool operator==(const Left& o) const {
      return x == o.x && v == o.v && a == o.a && m == o.m && fixed == o.fixed;
    }
  };

  template <class Layout>
  void order(const Bodies<Scalar, Layout>& bodies) {
    const std::size_t n = bodies.size();
    bodyOf_.clear();
    for (const bool massive : {true, false}) {
      for (std::size_t i = 0; i < n; ++i) {
        if (massive == (Scalar(bodies[i].mass()) > Scalar(0))) {
          bodyOf_.push_back(i);
        }
      }
      sources = massive ? bodyOf_.size() : sources;
    }
    m.resize(static_cast<Eigen::Index>(n));
    movable.clear();
    for (std::size_t row = 0; row < n; ++row) {
      const auto body = bodies[bodyOf_[row]];
      m[static_cast<Eigen::Index>(row)] = body.mass();
      if (!body.isFixed()) {
        movable.push_back(static_cast<std::uint32_t>(row));
      }
    }
    level.assign(n, 0);
  }

  template <class Self, class Visit>
  static void eachColumn(Self& self, Visit&& visit) {
    for (auto* columns : {&self.a, &self.j}) {
      for (auto& c : *columns) {
        visit(c);
      }
    }
    visit(self.wanted);
  }

  std::vector<std::size_t> bodyOf_;  // each row's
  std::vector<Left> left_;
};

}  // namespace gravel::detail
