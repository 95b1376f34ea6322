#include "support/space.hpp"

namespace gravel {
namespace detail {
template class IslandSweeps<double>;
template void IslandSweeps<double>::sweep<RowImpulses<double>::Way::Bare>();
template void IslandSweeps<double>::sweep<RowImpulses<double>::Way::Coasting>();
template class ImpactForecast<double>;
template class MultipoleWalk<double, double, HarmonicTerms>;
template class MultipoleWalk<double, double, AllTerms>;
}  // namespace detail
template class ContactProblem<double>;
template class SequentialImpulses<double>;
template class PositionalCorrection<double>;
template class ImpactEvents<double>;
template class ContactStage<double, SoA>;
}  // namespace gravel
