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
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (detail::isMovable(bodies, i)) {
        piles_[islands_.of(i)].add(Scalar(bodies.masses()[i]), Scalar(bodies.radii()[i]),
                                   Vector3<Scalar>(bodies.accelerations()[i]));
      }
    }
    for (const Contact<Scalar>& c : contacts) {
      if (detail::isMovable(bodies, c.first)) {
        Pile& pile = piles_[islands_.of(c.first)];
        ++pile.contacts;
        pile.roughness += roughness(contacts.material(c));
      }
    }
    for (const Pile& pile : piles_) {
      if (pile.a_sq > Scalar(0)) {
        const Scalar g = sqrt(Scalar(Scalar(5) / Scalar(3) * pile.a_sq));
        const Scalar rough = pile.roughness / Scalar(static_cast<double>(pile.contacts));
        const Scalar parts = Scalar(50) / (Scalar(3) + Scalar(2) * rough);  // 10 to 17
        const Scalar h = sqrt(Scalar(pile.d / g)) / parts;
        least = h > Scalar(0) && h < least ? h : least;  // 0 where a scalar's range was left
      }
    }
    return least;
  }

 private:
  /// Means by mass, of the bodies so far: neither m |a|^2 of a grain of dust nor m d of a sun is a float.
  struct Pile {
    std::size_t contacts = 0;  ///< of movable first bodies: not none where there are two bodies
    Scalar mass = Scalar(0);
    Vector3<Scalar> a = Vector3<Scalar>(Scalar(0), Scalar(0), Scalar(0));
    Scalar d = Scalar(0);
    Scalar a_sq = Scalar(0);       ///< |a - a_cm|^2; 0 of one body
    Scalar roughness = Scalar(0);  ///< sum over contacts

    /// West 1979, Communications of the ACM 22, 532.
    void add(const Scalar& m, const Scalar& r, const Vector3<Scalar>& its) {
      mass += m;
      const Scalar share = mass > Scalar(0) ? Scalar(m / mass) : Scalar(0);
      const Vector3<Scalar> off = its - a;
      a += share * off;
      d += share * (Scalar(2) * r - d);
      a_sq += share * ((Scalar(1) - share) * off.squaredNorm() - a_sq);
    }
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
