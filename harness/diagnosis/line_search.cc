#include "harness/diagnosis/line_search.h"

namespace dexcheck {

double FindMost(const std::function<double(double x)>& score, double begin, double end, double step,
                double least, int halvings) {
  double best = begin, most = least;
  const auto try_one = [&](double x) {
    const double value = score(x);
    if (value > most) most = value, best = x;
  };
  for (int i = 0; begin + i * step < end; ++i) try_one(begin + i * step);
  for (int i = 0; i < halvings; ++i, step *= 0.5) {
    const double centre = best;
    try_one(centre - 0.5 * step);
    try_one(centre + 0.5 * step);
  }
  return best;
}

}  // namespace dexcheck
