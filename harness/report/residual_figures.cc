#include <string>
#include <vector>

#include "harness/report/run_figures.h"
#include "renders/category_status.h"

namespace dexcheck {
namespace {

constexpr int kNamedCurves = 8;  // as many as there are colors

/// @param joints whether the robot holds nothing, and its joints follow a motion of their own.
const char* DescribeCategory(CheckCategory kind, bool joints) {
  switch (kind) {
    case CheckCategory::kModel:
      return "Model: both descriptions at the same state";
    case CheckCategory::kLaw:
      return joints ? "Law: torques against the law of the joints, and what they do"
                    : "Law: torques against (53)-(55), and what they do";
    case CheckCategory::kInverseDynamics:
      return "Balance: the engine's motion and forces in the model's equations";
    case CheckCategory::kForwardDynamics:
      return joints ? "Prediction: accelerations against the engine's"
                    : "Prediction: accelerations and contact forces against the engine's";
    case CheckCategory::kAssumption:
      return "Assumptions: what the equations take for granted";
  }
  return "";
}

Figure MakeFigure(const RunData& run, CheckCategory kind) {
  Figure figure;
  figure.name = std::string("residual_") + NameOf(kind);
  figure.title = DescribeCategory(kind, run.Find("joints/q_d") != nullptr);
  figure.label = "value / bound";
  figure.log = true;
  figure.bound = 1.0;
  figure.printed = true;
  std::string unseen;
  int named = 0;
  for (const CheckLine& check : run.checks()) {
    const std::string signal = "check/" + check.name;
    if (check.kind != kind || check.constant || run.Find(signal) == nullptr) continue;
    const VectorXd values = run.log().ReadSignal(signal).col(0);
    if (!(check.bound > 0.0) || !(values.array() > 0.0).any()) {
      unseen += (unseen.empty() ? "" : ", ") + check.name;
      continue;
    }
    const bool is_named = named++ < kNamedCurves;
    figure.curves.push_back(
        {check.name, values / check.bound, is_named ? named - 1 : kGrey, 0, false, is_named});
  }
  if (named > kNamedCurves) {
    figure.note =
        "The " + std::to_string(kNamedCurves) + " nearest to their bounds are named, the others grey. ";
  }
  if (!unseen.empty()) figure.note += "Not drawn, zero throughout or with bound 0: " + unseen + ".";
  return figure;
}

}  // namespace

std::vector<Figure> MakeResidualFigures(const RunData& run) {
  std::vector<Figure> figures;
  for (const CheckCategory kind : kCheckCategorys) {
    Figure figure = MakeFigure(run, kind);
    if (!figure.curves.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace dexcheck
