#pragma once

/// \file
/// The direct sum for so few bodies that putting them into columns would cost more than the sum.

#include <gravel/gravity/pair_law.hpp>

namespace gravel::detail {

/// Sums over at most `most` bodies, each pair once, in their own units: a body with two others at a time.
/// What was written as a packet is read as one, or number by number, never the other way: a packet of numbers
/// just written one by one has to wait for them.
template <class S>
struct FewBodies {
  static constexpr std::size_t most = 14;
  static constexpr bool usable = std::is_same_v<S, double> || std::is_same_v<S, long double>;

  /// out[i] as in DirectSum. \return false, with nothing written, for values that need its units or its
  /// words: not finite, negative, squared distances beyond 1e-100 … 1e100, coincident points
  template <class Positions, class Masses, class Accelerations>
  static bool accelerations(const Positions& positions, const Masses& masses, const S& G, const S& softening,
                            Accelerations& out) {
    const std::size_t n = positions.size();
    if (n > most || masses.size() != n || !(std::abs(G) <= S(1e100)) || !(softening >= S(0))) {
      return false;
    }
    Column x, y, z, m, ax, ay, az;  // at first the pull of those before
    for (std::size_t i = 0; i < n; i += 2) {
      const bool pair = i + 1 < n;  // else the last body stands there again, without a mass
      const std::size_t k = pair ? i + 1 : i;
      const Vector3<S> one = positions[i];
      const Vector3<S> two = positions[k];
      const S m_one = masses[i];
      const S m_two = masses[k];
      if (!(m_one >= S(0)) || !(m_one <= S(1e100)) || !(m_two >= S(0)) || !(m_two <= S(1e100))) {
        return false;
      }
      x.put(i, Pack(one[0], two[0]));
      y.put(i, Pack(one[1], two[1]));
      z.put(i, Pack(one[2], two[2]));
      m.put(i, Pack(m_one, pair ? m_two : S(0)));
      ax.put(i, Pack::Zero());
      ay.put(i, Pack::Zero());
      az.put(i, Pack::Zero());
    }
    // What is no pair adds nothing, and shall not look like one of points that coincide.
    const S e = softening * softening;
    const Pack ofOthers = Pack::Constant(e);
    const Pack ofItself(e + S(1), e);
    const Pack ofLast(e, n % 2 == 0 ? e : S(e + S(1)));
    Pack least = Pack::Constant(S(1));
    // What is not finite stays in it.
    Pack total = Pack::Zero();
    if (n == 1) {  // else each is in a pair
      total = x.pack(0) * S(0) + y.pack(0) * S(0) + z.pack(0) * S(0) + e;
    }
    S behind[most][3];  // the pull of those behind
    for (std::size_t i = 0; i < n; ++i) {
      const Pack x_i = Pack::Constant(x.at[i]);
      const Pack y_i = Pack::Constant(y.at[i]);
      const Pack z_i = Pack::Constant(z.at[i]);
      const Pack m_i = Pack::Constant(m.at[i]);
      Pack sx = Pack::Zero();
      Pack sy = Pack::Zero();
      Pack sz = Pack::Zero();
      for (std::size_t k = (i + 1) / 2 * 2; k < n && i + 1 < n; k += 2) {
        const Pack dx = x.pack(k) - x_i;
        const Pack dy = y.pack(k) - y_i;
        const Pack dz = z.pack(k) - z_i;
        const Pack s = dx * dx + dy * dy + dz * dz + (k == i ? ofItself : k + 2 < n ? ofOthers : ofLast);
        least = least.min(s);
        total += s;
        const Pack w = PairLaw<S>::accelerationFactor(s);
        const Pack f_i = m.pack(k) * w;
        const Pack f_k = m_i * w;
        sx += f_i * dx;
        sy += f_i * dy;
        sz += f_i * dz;
        ax.put(k, ax.pack(k) - f_k * dx);
        ay.put(k, ay.pack(k) - f_k * dy);
        az.put(k, az.pack(k) - f_k * dz);
      }
      behind[i][0] = sx[0] + sx[1];
      behind[i][1] = sy[0] + sy[1];
      behind[i][2] = sz[0] + sz[1];
    }
    if (!(least.minCoeff() >= S(1e-100)) || !(total.sum() <= S(1e100))) {
      return false;
    }
    for (std::size_t i = 0; i < n; ++i) {
      out[i] = Vector3<S>((behind[i][0] + ax.at[i]) * G, (behind[i][1] + ay.at[i]) * G,
                          (behind[i][2] + az.at[i]) * G);
    }
    return true;
  }

 private:
  using Pack = Lanes<S, 2>;

  /// A number of each body.
  struct Column {
    alignas(16) S at[most];
    Pack pack(std::size_t i) const { return Eigen::Map<const Pack>(at + i); }
    void put(std::size_t i, const Pack& p) { Eigen::Map<Pack>{at + i} = p; }
  };
  static_assert(most % 2 == 0);
};

}  // namespace gravel::detail
