#pragma once

/// \file
/// All of gravel.

#include <gravel/output/snapshot.hpp>
#include <gravel/output/vtk.hpp>
#include <gravel/space/space.hpp>
#include <gravel/spatial/morton.hpp>
#include <gravel/version.hpp>
