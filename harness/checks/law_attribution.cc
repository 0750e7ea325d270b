#include "harness/checks/law_attribution.h"

#include <cmath>
#include <cstdio>

namespace dexcheck {
namespace {

// What a summand explains less well than this is not its doing.
constexpr double kPartExplains = 0.98;
// A factor nearer to zero than this is one of a part that is missing.
constexpr double kZero = 1e-6;
// Two explanations that differ by less are equally good.
constexpr double kSame = 1e-10;

}  // namespace

LawAttribution::LawAttribution()
    : normal_(MatrixXd::Zero(kLawPartCount, kLawPartCount)), product_(VectorXd::Zero(kLawPartCount)) {}

void LawAttribution::Add(const Eigen::Ref<const VectorXd>& difference,
                         const Eigen::Ref<const MatrixXd>& parts, double weight) {
  const double w = weight * weight;
  normal_.noalias() += w * parts.transpose() * parts;
  product_.noalias() += w * parts.transpose() * difference;
  squares_ += w * difference.squaredNorm();
}

LawFinding LawAttribution::FindOne() const {
  LawFinding best;
  for (const LawPartName& entry : ListLawParts()) {
    VectorXd sum = VectorXd::Zero(kLawPartCount);  // of the summands in the entry
    for (int i = 0; i < kLawPartCount; ++i) sum[i] = (entry.parts >> i) & 1U;
    const double square = sum.dot(normal_ * sum);
    if (!(square > 0.0)) continue;
    const double change = sum.dot(product_) / square;
    const double explained = change * change * square / squares_;
    if (!(explained > best.explained + kSame)) continue;
    best = {entry.name, entry.symbol, 1.0 + change, explained};
  }
  return best;
}

std::string LawAttribution::Tell() const {
  if (!has_any()) return {};
  LawFinding found = FindOne();
  if (std::abs(found.factor) < kZero) found.factor = 0.0;
  char text[256];
  if (found.explained < kPartExplains) {
    std::snprintf(text, sizeof(text),
                  "no single part of (55) explains the torque difference; nearest: %s, %.0f %%",
                  found.name.c_str(), 100.0 * found.explained);
  } else {
    std::snprintf(text, sizeof(text),
                  "%s (%s) has %.6g times its value in (55); explains %.0f %% of the torque difference",
                  found.name.c_str(), found.symbol.c_str(), found.factor, 100.0 * found.explained);
  }
  return text;
}

}  // namespace dexcheck
