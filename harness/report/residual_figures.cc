#include <string>
#include <vector>

#include "harness/report/run_figures.h"

namespace dexcheck {
namespace {

constexpr int kNamedCurves = 8;  // as many as there are colors

Figure MakeFigure(const RunData& run, CheckCategory kind) {
  Figure figure{.name = std::string("residual_") + NameOf(kind),
                .title = std::string(TitleOf(kind)) + ": " + run.Explain(kind),
                .label = "value / bound",
                .log = true,
                .bound = 1.0,
                .printed = true};
  std::string unseen;
  int named = 0;
  for (const CheckRecord& check : run.checks()) {
    const std::string signal = "check/" + check.name;
    if (check.kind != kind || !IsTimed(check) || run.Find(signal) == nullptr) continue;
    const VectorXd values = run.log().ReadSignal(signal).col(0);
    if (!(check.bound > 0.0) || !(values.array() > 0.0).any()) {
      unseen += (unseen.empty() ? "" : ", ") + check.name;
      continue;
    }
    const bool is_named = named++ < kNamedCurves;
    figure.curves.push_back({.label = check.name,
                             .values = values / check.bound,
                             .color = is_named ? named - 1 : kGrey,
                             .in_key = is_named});
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
  for (const CheckCategory kind : kCheckCategories) {
    Figure figure = MakeFigure(run, kind);
    if (!figure.curves.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace dexcheck
