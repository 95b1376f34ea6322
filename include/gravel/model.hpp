#pragma once

/// \file
/// Plain names for the double, structure-of-arrays instantiation: `Model::Space` and what goes with it.

#include <gravel/gravel.hpp>

namespace Configuration {
using SimulationConfig = gravel::SimulationConfig<double>;
}  // namespace Configuration

namespace Model {

using Vector3d = gravel::Vector3<double>;
using Vector3dVec = std::vector<Vector3d>;
using Quaterniond = gravel::Quaternion<double>;
using QuaterniondVec = std::vector<Quaterniond>;

using Space = gravel::Space<double, gravel::SoA>;
using Bodies = Space::Bodies;
using BodyProxy = Space::BodyProxy;
using ConstBodyProxy = Space::ConstBodyProxy;
using CollisionContext = Space::CollisionContext;
using KDTree = gravel::KDTree<double>;

}  // namespace Model
