#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "controller/common/errors.h"
#include "harness/base/bounded_json.h"
#include "harness/report/page.h"

namespace dexcheck {
namespace {

/// Escapes any text for LaTeX; "s^2" has its exponent.
std::string EscapeTex(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || c == '~') {
      escaped += c == '~' ? "\\textasciitilde{}" : "\\textbackslash{}";
    } else if (c == '^') {
      escaped += "\\textsuperscript ";  // takes the next character
    } else {
      if (std::string_view("#$%&_{}").find(c) != std::string_view::npos) escaped += '\\';
      escaped += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
  }
  return escaped;
}

std::string Typewriter(std::string_view text) { return "\\texttt{" + EscapeTex(text) + "}"; }

/// With three digits: "$1.23\times10^{-4}$".
std::string FormatTex(double value) {
  if (!std::isfinite(value)) return std::isnan(value) ? "not a number" : "$\\infty$";
  const std::string text = fmt::format("{:.3g}", value);
  const size_t exponent = text.find('e');
  if (exponent == std::string::npos) return "$" + text + "$";
  return fmt::format("${}\\times10^{{{}}}$", text.substr(0, exponent), std::stoi(text.substr(exponent + 1)));
}

std::string WithSpaces(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string MakeRow(const std::string& kind, const std::string& what, double value, const std::string& bound,
                    std::string_view unit) {
  return fmt::format("    {} & {} & {} & {} & {} \\\\\n", kind, what, FormatTex(value), bound,
                     EscapeTex(unit));
}

/// "position_error_max_m": the unit stands last.
std::string MakeTrackingRows(const RunData& run) {
  std::string rows;
  const nlohmann::json tracking = run.summary().value("tracking", nlohmann::json::object());
  for (const auto& [key, value] : tracking.items()) {
    const size_t unit = key.rfind('_') + 1;
    if (value.is_number())
      rows +=
          MakeRow("tracking", WithSpaces(key.substr(0, unit - 1)), value.get<double>(), "", key.substr(unit));
  }
  return rows;
}

/// The checks stand with the worst first.
std::string MakeCategoryRow(const RunData& run, CheckCategory category) {
  const auto belongs = [&](const CheckRecord& check) { return check.kind == category && IsReached(check); };
  const auto worst = std::ranges::find_if(run.checks(), belongs);
  if (worst == run.checks().end()) return "";
  const auto count = std::ranges::count_if(run.checks(), belongs);
  return MakeRow(fmt::format("{} ({})", WithSpaces(NameOf(category)), count),
                 Typewriter(worst->name) + (worst->failed ? " \\textbf{fails}" : ""),
                 worst->failed ? worst->worst : worst->residual, FormatTex(worst->bound), worst->unit);
}

std::string MakeCaption(const RunData& run) {
  const std::string verdict = run.is_cut_off() ? "cut off" : run.FindSummaryText("/verdict");
  const std::string revision = run.FindText("git_revision");
  return fmt::format(
      "Scenario {}: {} after {} steps. Of each category of checks, with their number, the one "
      "nearest its bound. Made by {}, dexcheck {} (commit {}), MuJoCo {}.",
      Typewriter(run.FindText("scenario")), EscapeTex(verdict), run.time().size(),
      Typewriter(run.FindText("command")), EscapeTex(run.FindText("dexcheck_version")),
      revision.empty() ? "unknown" : Typewriter(revision), EscapeTex(run.FindText("mujoco_version")));
}

}  // namespace

std::string MakeTexTable(const RunData& run) {
  try {
    std::string rows = MakeTrackingRows(run);
    if (!rows.empty()) rows += "    \\midrule\n";
    for (const CheckCategory category : kCheckCategories) rows += MakeCategoryRow(run, category);
    return fmt::format(
        "% Needs \\usepackage{{booktabs}}.\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n"
        "  \\begin{{tabular}}{{llrrl}}\n    \\toprule\n    Category & Result & Largest & Bound & Unit \\\\\n "
        "   \\midrule\n"
        "{}    \\bottomrule\n  \\end{{tabular}}\n\\end{{table}}\n",
        MakeCaption(run), rows);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(run.log().path().string() + ": summary: " + DescribeJsonError(error));
  }
}

}  // namespace dexcheck
