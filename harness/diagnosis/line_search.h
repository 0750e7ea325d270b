#pragma once

#include <functional>

namespace dexcheck {

/// The x at which a score is largest: the best of begin, begin + step, ... below `end`, moved by halves of
/// the step as often as is asked for. Where no score is above `least`, it is `begin`.
double FindMost(const std::function<double(double x)>& score, double begin, double end, double step,
                double least = 0.0, int halvings = 16);

}  // namespace dexcheck
