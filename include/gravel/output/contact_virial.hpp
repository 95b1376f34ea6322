#pragma once

/// \file
/// Errors of a whole heap without a reference solution: do its contacts carry what presses on them?

#include <gravel/bodies/bodies.hpp>
#include <gravel/contact/contact.hpp>
#include <gravel/contact/contact_settings.hpp>
#include <gravel/core/parallel.hpp>
#include <gravel/core/sizes.hpp>

#include <span>

namespace gravel {

/// Terms of the virial theorem over a step, about the centre of mass [J], in an open domain (x of what hangs
/// together across a periodic face is not one place):
///   I''/2 = motion + forces + contacts + boundaries,   I = sum m x^2.
/// In a heap at rest the sum vanishes, whatever friction does: forces along the line of two centres do the
/// work N d, friction across it none.
template <Real Scalar>
struct ContactVirial {
  using Wide = detail::AtLeastDouble<Scalar>;  // the energy of dust is no float
  Wide motion = Wide(0);                       ///< 2 T, twice the kinetic energy about the centre of mass
  Wide forces = Wide(0);      ///< sum F.x of gravity, field and the user's force; -|W| for gravity alone
  Wide contacts = Wide(0);    ///< sum N d of pairs: normal force times distance of the centres
  Wide boundaries = Wide(0);  ///< sum F.x of boundaries and fixed bodies on what they hold

  /// I''/2: how fast a heap that should rest expands or falls together.
  Wide sum() const { return motion + forces + contacts + boundaries; }
  /// |sum| over the largest term; 0 where there is nothing.
  Scalar residual() const {
    const Wide scale = std::max({detail::sizeOf(motion), detail::sizeOf(forces), detail::sizeOf(contacts),
                                 detail::sizeOf(boundaries)});
    return scale > Wide(0) ? Scalar(detail::sizeOf(sum()) / scale) : Scalar(0);
  }
};

/// What presses on boundaries and fixed bodies, against the weight of all movable bodies in a uniform field;
/// what a frame that turns presses is no weight.
template <Real Scalar>
struct SupportedWeight {
  Vector3<Scalar> load = Vector3<Scalar>::Zero();    ///< [N] on boundaries and fixed bodies, over the step
  Vector3<Scalar> weight = Vector3<Scalar>::Zero();  ///< [N] sum m g

  /// |load - weight| along the field over the weight; 0 without a field. A heap that moves inside is off by
  /// the acceleration of its centre of mass.
  Scalar residual() const {
    using Wide = detail::AtLeastDouble<Scalar>;
    const Vector3<Wide> w = weight.template cast<Wide>();
    const Wide missing = w.dot(Vector3<Wide>(load.template cast<Wide>() - w));
    const Wide w_sq = w.squaredNorm();
    return w_sq > Wide(0) ? Scalar(detail::sizeOf(missing) / w_sq) : Scalar(0);
  }
};

/// Positions, velocities and `forces()` of bodies that are moved by contacts with these impulses [N s] over a
/// step h [s]. Zero contacts if h is 0. Fixed bodies take no part but as what others lean on. O(bodies +
/// contacts); the same bits for any number of threads.
template <Real Scalar, class Layout>
ContactVirial<Scalar> contactVirial(const Bodies<Scalar, Layout>& bodies,
                                    std::span<const Contact<Scalar>> contacts,
                                    std::span<const ContactImpulse<Scalar>> impulses, const Scalar& h) {
  using Wide = detail::AtLeastDouble<Scalar>;
  const auto wide = [](const auto& v) { return Vector3<Wide>(Vector3<Scalar>(v).template cast<Wide>()); };
  using Sum = Eigen::Array<Wide, 7, 1>;
  const Sum of = orderedSum(bodies.size(), 1024, Sum(Sum::Zero()), [&](std::size_t begin, std::size_t end) {
    Sum part = Sum::Zero();
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = bodies[i];
      if (!body.isFixed()) {
        const auto m = Wide(body.mass());
        part[0] += m;
        part.template segment<3>(1) += Vector3<Wide>(m * wide(body.position())).array();
        part.template segment<3>(4) += Vector3<Wide>(m * wide(body.velocity())).array();
      }
    }
    return part;
  });
  ContactVirial<Scalar> virial;
  if (!(of[0] > Wide(0))) {
    return virial;
  }
  const Vector3<Wide> centre = of.template segment<3>(1).matrix() / of[0];
  const Vector3<Wide> drift = of.template segment<3>(4).matrix() / of[0];
  using TwoSums = Eigen::Array<Wide, 2, 1>;
  const TwoSums terms =
      orderedSum(bodies.size(), 1024, TwoSums(TwoSums::Zero()), [&](std::size_t begin, std::size_t end) {
        TwoSums part = TwoSums::Zero();
        for (std::size_t i = begin; i < end; ++i) {
          const auto body = bodies[i];
          if (!body.isFixed()) {
            part[0] += Wide(body.mass()) * Vector3<Wide>(wide(body.velocity()) - drift).squaredNorm();
            part[1] += wide(body.force()).dot(Vector3<Wide>(wide(body.position()) - centre));
          }
        }
        return part;
      });
  virial.motion = terms[0];
  virial.forces = terms[1];
  for (std::size_t k = 0; k < impulses.size() && h > Scalar(0); ++k) {
    const Contact<Scalar>& c = contacts[k];
    const ContactImpulse<Scalar>& j = impulses[k];
    const bool boundary = c.second == staticPartner;
    if (!boundary && !bodies[c.first].isFixed() && !bodies[c.second].isFixed()) {
      virial.contacts += Wide(j.normal) * Wide(c.arm1 + c.arm2) / Wide(h);
    } else {
      const Vector3<Wide> onSecond = (Wide(j.normal) * wide(c.normal) + wide(j.tangential)) / Wide(h);
      const bool holdsSecond = !boundary && bodies[c.first].isFixed();
      const Vector3<Wide> x = wide(bodies[holdsSecond ? c.second : c.first].position());
      virial.boundaries += (holdsSecond ? onSecond : Vector3<Wide>(-onSecond)).dot(Vector3<Wide>(x - centre));
    }
  }
  return virial;
}

/// Load on boundaries and fixed bodies by contacts with these impulses over a step h, and the weight.
template <Real Scalar, class Layout>
SupportedWeight<Scalar> supportedWeight(const Bodies<Scalar, Layout>& bodies,
                                        std::span<const Contact<Scalar>> contacts,
                                        std::span<const ContactImpulse<Scalar>> impulses, const Scalar& h,
                                        const Vector3<Scalar>& field) {
  SupportedWeight<Scalar> support;
  Scalar mass(0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    mass += bodies[i].isFixed() ? Scalar(0) : Scalar(bodies[i].mass());
  }
  support.weight = mass * field;
  for (std::size_t k = 0; k < impulses.size() && h > Scalar(0); ++k) {
    const Contact<Scalar>& c = contacts[k];
    const Vector3<Scalar> onSecond = (impulses[k].normal * c.normal + impulses[k].tangential) / h;
    if (c.second == staticPartner || bodies[c.second].isFixed()) {
      support.load += onSecond;
    } else if (bodies[c.first].isFixed()) {
      support.load -= onSecond;
    }
  }
  return support;
}

}  // namespace gravel
