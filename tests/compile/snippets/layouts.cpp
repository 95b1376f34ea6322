// error: gravel: the Layout of Bodies must be SoA, AoS, AoSoA<W> or a type that meets gravel::BodyStorage
// error: gravel: the storage's Scalar must be the Scalar of Bodies
// error: gravel: AoSoA<W> needs a power of two
#include <gravel/bodies/bodies.hpp>

template class gravel::Bodies<double, gravel::SoA>;
template class gravel::Bodies<float, gravel::AoS>;
template class gravel::Bodies<long double, gravel::AoSoA<4>>;

struct NotAStorage {
  using Scalar = double;
  std::size_t size() const { return 0; }
};

#if GRAVEL_WRONG == 1
template class gravel::Bodies<double, NotAStorage>;
#elif GRAVEL_WRONG == 2
template class gravel::Bodies<double, gravel::SoA::Storage<float>>;
#elif GRAVEL_WRONG == 3
template class gravel::Bodies<double, gravel::AoSoA<6>>;
#endif
