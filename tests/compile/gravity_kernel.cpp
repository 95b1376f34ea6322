// Direct gravity on a user's own arrays, in double and float: cmake/check_packed_sqrt.cmake reads its machine
// code.
#include <gravel/gravity/direct_sum.hpp>

#include <vector>

template <class Scalar>
using Vectors = std::vector<gravel::Vector3<Scalar>>;

void inDouble(const Vectors<double>& positions, const std::vector<double>& masses, Vectors<double>& out) {
  gravel::DirectSum<double>().accelerations(positions, masses, 6.6743e-11, 0.0, out);
}

void inFloat(const Vectors<float>& positions, const std::vector<float>& masses, Vectors<float>& out) {
  gravel::DirectSum<float>().accelerations(positions, masses, 6.6743e-11F, 0.0F, out);
}
