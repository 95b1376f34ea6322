#pragma once

/// \file
/// The longest step in which a pile that its own gravity holds together comes to rest.
///
/// A grain at the surface falls by g h^2/2 in a step before contacts hold it again. Where that is more than a
/// hundredth or so of its diameter d the pile does not rest: it boils. At rest are all piles of 200 to 10 000
/// grains with
///   h <= 0.1 sqrt(d/g)
/// all boil from 0.18 on (measured: docs/theory-time-step.md). Without friction, which takes what motion a
/// step leaves, most boil at 0.1, too, and some for long at 0.08: below a static coefficient of 0.02 the
/// limit goes down, to 0.06. In a ball of even density accelerations have the root of the mean square
/// sqrt(3/5) g (g at its surface, by mass), which is what g is found by here.

#include <gravel/contact/contact_islands.hpp>
#include <gravel/contact/contact_list.hpp>

#include <limits>

namespace gravel {

/// Islands of contacts, with room for the next step's.
template <Real Scalar>
class PileStep {
 public:
  /// [s] The shortest of these steps over all that contacts join, infinity without any. Diameters and
  /// accelerations are means by mass, so that a pebble on a planet asks for nothing; accelerations are
  /// relative to the centre of mass of those joined, so that neither a common fall nor an orbit does. Of the
  /// pull of others only tides count. Friction is the mean over the contacts of a pile, each counting 0.02 at
  /// most. O(bodies + contacts), one thread.
  template <ContactBodies B>
  Scalar longest(const B& bodies, const ContactView<Scalar>& contacts) {
    using std::sqrt;
    auto least = Scalar(std::numeric_limits<double>::infinity());
    if (contacts.empty()) {
      return least;
    }
    islands_.find(contacts.contacts, bodies);
    piles_.assign(bodies.size(), Pile{});
    const auto each = [&](auto&& f) {
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        if (detail::isMovable(bodies, i)) {
          f(piles_[islands_.of(i)], Scalar(bodies.masses()[i]), i);
        }
      }
    };
    each([&](Pile& pile, const Scalar& m, std::size_t i) {
      ++pile.count;
      pile.mass += m;
      pile.a += m * Vector3<Scalar>(bodies.accelerations()[i]);
    });
    each([&](Pile& pile, const Scalar& m, std::size_t i) {
      if (pile.count > 1) {
        // By shares: the mass of a sun times its diameter is no float.
        pile.d += m / pile.mass * Scalar(2) * Scalar(bodies.radii()[i]);
        pile.a_sq += m * (Vector3<Scalar>(bodies.accelerations()[i]) - pile.a / pile.mass).squaredNorm();
      }
    });
    for (const Contact<Scalar>& c : contacts) {
      if (detail::isMovable(bodies, c.first)) {
        Pile& pile = piles_[islands_.of(c.first)];
        ++pile.contacts;
        pile.roughness += roughness(contacts.material(c));
      }
    }
    for (const Pile& pile : piles_) {
      if (pile.a_sq > Scalar(0)) {
        const Scalar g = sqrt(Scalar(Scalar(5) / Scalar(3) * (pile.a_sq / pile.mass)));
        const Scalar rough = pile.roughness / Scalar(static_cast<double>(pile.contacts));
        const Scalar parts = Scalar(50) / (Scalar(3) + Scalar(2) * rough);  // 10 to 17
        const Scalar h = sqrt(Scalar(pile.d / g)) / parts;
        least = h > Scalar(0) && h < least ? h : least;  // 0 where a scalar's range was left
      }
    }
    return least;
  }

 private:
  struct Pile {
    std::size_t count = 0;
    std::size_t contacts = 0;  ///< of movable first bodies: not none where there are two bodies
    Scalar mass = Scalar(0);
    Vector3<Scalar> a = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));  ///< sum of m a
    Scalar d = Scalar(0);                                                  ///< mean of d by mass
    Scalar a_sq = Scalar(0);                                               ///< sum of m |a - a_cm|^2
    Scalar roughness = Scalar(0);                                          ///< sum over contacts
  };

  /// 0 without friction to 1 where there is enough of it for a pile to rest in the longer steps.
  static Scalar roughness(const Material<Scalar>& m) {
    const Scalar holds = m.staticFriction < m.kineticFriction ? m.kineticFriction : m.staticFriction;
    const Scalar share = Scalar(50) * holds;
    return share < Scalar(1) ? share : Scalar(1);
  }

  ContactIslands islands_;
  std::vector<Pile> piles_;  ///< by the smallest index of a body in it
};

}  // namespace gravel
