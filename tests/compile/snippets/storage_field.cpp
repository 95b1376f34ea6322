// error: gravel: gravel's own storages hold the fields of gravel::RealFields only
#include <gravel/bodies/storage.hpp>

struct Temperature {
  static constexpr const char* name = "temperature";
  static constexpr int width = 1;
};

double radius(gravel::StorageOf<double, gravel::SoA>& storage) {
  return storage.at(gravel::fields::Radius{}, 0);
}

#if GRAVEL_WRONG == 1
double temperature(gravel::StorageOf<double, gravel::SoA>& storage) { return storage.at(Temperature{}, 0); }
#endif
