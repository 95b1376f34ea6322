#pragma once

/// The usual space, and those of its parts that others have in common with it. Their code is made once for
/// all programs here, in space.cpp and space_parts.cpp: that halves the time of their build. (A member that
/// is written in its class is made again where it may be inlined; so is what only such members call, but for
/// what is named here.)

#include <gravel/space/space.hpp>

namespace gravel {
namespace detail {
extern template class IslandSweeps<double>;
extern template void IslandSweeps<double>::sweep<RowImpulses<double>::Way::Bare>();
extern template void IslandSweeps<double>::sweep<RowImpulses<double>::Way::Coasting>();
extern template class ImpactForecast<double>;
extern template class MultipoleWalk<double, double, HarmonicTerms>;
extern template class MultipoleWalk<double, double, AllTerms>;
}  // namespace detail
extern template class ContactProblem<double>;
extern template class SequentialImpulses<double>;
extern template class PositionalCorrection<double>;
extern template class ImpactEvents<double>;
extern template class ContactStage<double, SoA>;
extern template class Space<double, SoA>;
}  // namespace gravel
