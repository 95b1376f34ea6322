#pragma once

/// \file
/// The next step from pairs of bodies, and steps that run backwards as they ran forwards.
///
/// For a pair at distance r with relative speed v the rates of free fall and of flying by are
///   b = sqrt(G (m1 + m2)/r^3),   a = v/r
/// and its motion asks for the rate (b^4 (a^4 + b^4)/2)^(1/8): b on a circular orbit, sqrt(a b) up to a
/// constant for a fast pass, which gravity hardly bends, nothing where there is no gravity. The pairs' rates
/// and the longest step are added in their eighth powers, which is close to the largest of them, and smooth:
///   h = h_max / (1 + sum over pairs (h_max rate / eta)^8)^(1/8)
/// All of it is even in the velocities, depends on differences alone, and does not notice a body's passing
/// through a point of zero acceleration.

#include <gravel/dynamics/adaptive_step.hpp>
#include <gravel/dynamics/largest_pair_rate.hpp>

#include <optional>

namespace gravel {

/// Most bodies for which all pairs are looked at. Above, the pair of the largest rate is searched where
/// masses are unlike; where they are alike, or there are images, each body is taken with its likeliest
/// partner: one of mean mass, at the distance at which it alone would cause the body's acceleration, but not
/// closer than touching.
inline constexpr std::size_t encounterPairs = 128;

/// Masses are unlike if one body has more than so many times the mean of the others, tracers aside,
inline constexpr double unlikeMasses = 4;
/// or less than the mean over this: two that are lighter still, and bound, would get less than a quarter of
/// the steps that they ask for, as they pull each other less than a body of mean mass would.
inline constexpr double lightMasses = 64;

namespace detail {

template <class S>
S eighthRoot(const S& x) {
  using std::sqrt;
  return sqrt(S(sqrt(S(sqrt(x)))));
}

/// All bodies in columns.
template <class S, class Scalar>
class EncounterTable {
 public:
  using Column = Eigen::Array<S, Eigen::Dynamic, 1, 0, static_cast<int>(encounterPairs), 1>;

  /// \param domain  pairs are nearest through its images, which are where they are at `time` [s]
  template <class BodiesType>
  EncounterTable(const BodiesType& bodies, const Domain<Scalar>& domain, const Scalar& time)
      : n_(static_cast<Eigen::Index>(bodies.size())), domain_(domain), time_(time) {
    for (Column* c : {&x_, &y_, &z_, &u_, &v_, &w_, &m_, &r_, &free_}) {
      c->resize(n_);
    }
    for (Eigen::Index i = 0; i < n_; ++i) {
      const auto body = bodies[static_cast<std::size_t>(i)];
      const Vector3<S> x = body.position().template cast<S>();
      const Vector3<S> v = body.countingVelocity().template cast<S>();
      x_[i] = x[0], y_[i] = x[1], z_[i] = x[2];
      u_[i] = v[0], v_[i] = v[1], w_[i] = v[2];
      m_[i] = S(body.mass());
      r_[i] = S(body.radius());
      free_[i] = body.isFixed() ? S(0) : S(1);
      spheres_ = spheres_ || r_[i] > S(0);
    }
  }

  /// Sums (rate T)^8 over the pairs, and finds the largest (T speed)^2 / (gap + radius/4)^2, where the radius
  /// is the smaller of the two, or that of the only sphere.
  void look(const S& G, const S& softening, const S& T, S& sum, S& approach) const {
    using std::sqrt;
    const S T_sq = T * T;
    const S nearest = nearestSquared<S>();
    Column s, speed_sq, a, b;
    for (Eigen::Index i = 0; i + 1 < n_; ++i) {
      const Eigen::Index k = n_ - i - 1;
      s = (x_.tail(k) - x_[i]).square() + (y_.tail(k) - y_[i]).square() + (z_.tail(k) - z_[i]).square();
      speed_sq =
          (u_.tail(k) - u_[i]).square() + (v_.tail(k) - v_[i]).square() + (w_.tail(k) - w_[i]).square();
      if (!domain_.isOpen()) {
        throughImages(i, s, speed_sq);
      }
      if (free_[i] == S(0)) {
        speed_sq *= free_.tail(k);
      }
      if (spheres_) {
        a = r_.tail(k).min(r_[i]);
        a = (a > S(0)).select(a, r_.tail(k) + r_[i]) / S(4);
        a += (s.sqrt() - (r_.tail(k) + r_[i])).max(S(0));
        b = (a > S(0)).select(speed_sq * T_sq / (a * a), Column::Constant(k, S(0)));
        approach = std::max<S>(approach, b.maxCoeff());
        s = s.max((r_.tail(k) + r_[i]).square());  // nothing gets closer than touching
      }
      s += softening * softening;
      // Two points in one place do not pull each other.
      s = (s > S(0)).select(s.max(nearest).inverse(), Column::Constant(k, S(0)));
      a = speed_sq * s * T_sq;
      b = (m_.tail(k) + m_[i]) * (G * T_sq) * s;
      b *= b * s;  // the cube of s alone may be out of range
      if (free_[i] == S(0)) {
        b *= free_.tail(k);
      }
      sum += (b * a * a + b * b).sum() / S(2);
    }
  }

 private:
  /// Squares of distances and speeds of i and those after it, by the nearest images.
  void throughImages(Eigen::Index i, Column& s, Column& speed_sq) const {
    for (Eigen::Index k = 0, j = i + 1; j < n_; ++k, ++j) {
      Vector3<Scalar> r = Vector3<S>(x_[j] - x_[i], y_[j] - y_[i], z_[j] - z_[i]).template cast<Scalar>();
      Vector3<Scalar> v = Vector3<S>(u_[j] - u_[i], v_[j] - v_[i], w_[j] - w_[i]).template cast<Scalar>();
      domain_.minimumImage(r, v, time_);
      s[k] = r.template cast<S>().squaredNorm();
      speed_sq[k] = v.template cast<S>().squaredNorm();
    }
  }

  Eigen::Index n_;
  Domain<Scalar> domain_;
  Scalar time_;
  Column x_, y_, z_, u_, v_, w_, m_, r_;
  Column free_;  ///< 0 for fixed bodies, which ask nothing of each other
  bool spheres_ = false;
};

/// The largest (rate T)^8 of a body with its likeliest partner of the mean mass (tracers aside), and the
/// largest (T speed)^2 / (radius/4)^2. O(N).
template <class S, Real Scalar, class Layout>
void lookAtLikeliest(const Bodies<Scalar, Layout>& bodies, const Domain<Scalar>& domain, const S& G,
                     const S& softening, const S& T, S& sum, S& approach) {
  using std::sqrt;
  const std::size_t n = bodies.size();
  const auto flow = FlowLeftOut<Scalar>::of(bodies, domain);
  const auto lessFlow = [&](std::size_t i, const Vector3<Scalar>& v) {
    return Vector3<S>(flow.domain.lessFlow(bodies[i].position(), v).template cast<S>());
  };
  S mass(0);
  std::size_t massive = 0;
  bool anchored = false;  // by what is fixed, which makes rest absolute
  Vector3<S> v_cm = Vector3<S>::Zero();
  Vector3<S> a_cm = Vector3<S>::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const S m = S(bodies.masses()[i]);
    mass += m;
    massive += m > S(0) ? 1U : 0U;
    v_cm += lessFlow(i, bodies[i].countingVelocity()) * m;
    a_cm += bodies.accelerations()[i].template cast<S>() * m;
    anchored = anchored || bodies[i].isFixed();
  }
  if (anchored) {
    v_cm = a_cm = Vector3<S>::Zero();
  } else if (mass > S(0)) {
    v_cm /= mass;
    a_cm /= mass;
  }
  const auto speedSq = [&](std::size_t i) {
    return S(Vector3<S>(lessFlow(i, bodies.velocities()[i]) - v_cm).squaredNorm() * T * T);
  };
  const S sheared = S(flow.across) * T;
  const S Gm = massive > 0 ? S(G * mass / S(static_cast<double>(massive)) * T * T) : S(0);
  sum = -orderedMin(n, 2048, S(0), [&](std::size_t i) {
    const auto body = bodies[i];
    const S a = Vector3<S>(body.acceleration().template cast<S>() - a_cm).norm() * T * T;
    if (body.isFixed() || !(a > S(0))) {
      return S(0);
    }
    const S touching = S(2) * S(body.radius());
    const S s = S(1) / (Gm / a + touching * touching + softening * softening);
    const S fly = speedSq(i) * s;
    const S fall = Gm * Gm * s * s * s;
    return S(-fall * (fly * fly + fall) / S(2));
  });
  approach = -orderedMin(n, 2048, S(0), [&](std::size_t i) {
    const S r = S(bodies.radii()[i]);
    if (!(r > S(0)) || bodies[i].isFixed()) {
      return S(0);
    }
    const S moved_sq = speedSq(i);
    if (!(sheared > S(0))) {
      return S(-S(16) * moved_sq / (r * r));
    }
    const S way = (moved_sq > S(0) ? S(sqrt(moved_sq)) : S(0)) + sheared;
    return S(-S(16) * way * way / (r * r));
  });
}

/// See unlikeMasses and lightMasses. O(N).
template <class S, class BodiesType>
bool haveUnlikeMasses(const BodiesType& bodies) {
  S heaviest(0);
  S lightest(0);
  S others(0);
  std::size_t massive = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const S m = S(bodies.masses()[i]);
    others += std::min<S>(m, heaviest);
    heaviest = std::max<S>(heaviest, m);
    lightest = lesserPositive<S>(lightest, m);
    massive += m > S(0) ? 1U : 0U;
  }
  const S count = S(static_cast<double>(massive));
  return massive > 1 && ((count - S(1)) * heaviest > S(unlikeMasses) * others ||
                         S(lightMasses) * count * lightest < heaviest + others);
}

}  // namespace detail

/// The step by the rules above, within the limits and not below 1e-12 of the longest; nor does any pair meet
/// deeper than a quarter of the smaller radius in a step. Up to `encounterPairs` bodies O(N^2), about as dear
/// as their gravity. Above O(N), or O(N log N) where masses are unlike; there it is enough, too, if no sphere
/// moves by more than a quarter of its radius, relative to the common centre of mass (absolute where a body
/// is fixed), and only where that asks for a shorter step pairs are searched, in O(N log N).
///
/// \param domain unless open, pairs are nearest through images: above, the likeliest partner is meant for any
///        masses, and for any number no sphere moves by more than a quarter of its radius, the flow left out
///        as in adaptive_step.hpp
/// \param time [s] for a domain that shears
/// \throws std::invalid_argument of validate(limits)
template <Real Scalar, class Layout>
Scalar stepFromEncounters(const Bodies<Scalar, Layout>& bodies, const Scalar& G, const Scalar& softening,
                          const StepLimits<Scalar>& limits, const Domain<Scalar>& domain = {},
                          const Scalar& time = Scalar(0)) {
  using S = detail::AtLeastDouble<Scalar>;  // of 8th powers
  using std::sqrt;
  validate(limits);
  const S T = S(limits.largest) / S(limits.factor);
  S sum(0);
  S approach(0);
  const bool few = bodies.size() <= encounterPairs;
  std::optional<detail::LargestPairRate<S>> pairs;
  if (!few || !domain.isOpen()) {
    detail::lookAtLikeliest<S>(bodies, domain, S(G), S(softening), T, sum, approach);
  }
  if (few) {
    S meets(0);
    sum = S(0);
    detail::EncounterTable<S, Scalar>(bodies, domain, time).look(S(G), S(softening), T, sum, meets);
    approach = domain.isOpen() ? meets : approach;
  } else if (domain.isOpen() && detail::haveUnlikeMasses<S>(bodies)) {
    pairs.emplace(bodies);
    sum = pairs->of(detail::EncounterRate<S>{S(G), T, S(softening)}, detail::highest<S>());
  }
  S h = S(limits.largest) / detail::eighthRoot(S(S(1) + sum));
  const S longest = S(limits.contactSteps) * T;  // over the square root of an approach
  if (domain.isOpen() && !few && longest < h * sqrt(approach)) {
    const S enough = approach / (T * T);
    if (!pairs) {
      pairs.emplace(bodies);
    }
    const S most = pairs->of(detail::MeetingRate<S>{}, enough);
    approach = most < enough ? S(T * T * most) : approach;
  }
  if (approach > S(0)) {
    h = std::min<S>(h, longest / sqrt(approach));
  }
  const Scalar least = std::max<Scalar>(limits.smallest, limits.largest * Scalar(1e-12));
  return std::min<Scalar>(std::max<Scalar>(Scalar(h), least), limits.largest);
}

/// [s] The step after one of length `last`, where the state between them asks for `wanted`: the two steps'
/// mean rate is the rate wanted, 1/next + 1/last = 2/wanted (Huang & Leimkuhler 1997, SIAM J. Sci. Comput.
/// 18, 239). From the state after it, backwards, the same rule gives `last`: the map is as reversible as a
/// fixed step, and its energy does not drift. Where `last` was far from `wanted`, it is `wanted`.
template <Real Scalar>
Scalar reversibleStep(const Scalar& last, const Scalar& wanted) {
  // 2/3 … 2 of the step wanted, a range that the rule maps on itself.
  if (!(Scalar(3) * last >= Scalar(2) * wanted) || !(last <= Scalar(2) * wanted)) {
    return wanted;
  }
  return wanted * Scalar(last / (Scalar(2) * last - wanted));
}

}  // namespace gravel
