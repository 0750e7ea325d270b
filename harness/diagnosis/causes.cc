#include "harness/diagnosis/causes.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr size_t kMostTold = 4;

std::string Unit(const std::string& unit) { return unit.empty() ? "" : " " + unit; }

}  // namespace

const char* NameOf(CauseChannel channel) {
  constexpr const char* kNames[] = {"measurement", "actuation", "law",     "contact",
                                    "geometry",    "rolling",   "balance", "observation"};
  return kNames[static_cast<size_t>(channel)];
}

const char* NameOf(CauseOutcome outcome) {
  constexpr const char* kNames[] = {"named", "class", "not explained", "observed"};
  return kNames[static_cast<size_t>(outcome)];
}

std::string FormatVector(const Eigen::Ref<const VectorXd>& v, int digits) {
  constexpr double kRounding = 1e-9;
  const double rounding = v.size() > 0 ? kRounding * v.cwiseAbs().maxCoeff() : 0.0;
  std::string text = "(";
  for (Eigen::Index i = 0; i < v.size(); ++i)
    text += (i > 0 ? ", " : "") + FormatNumber(std::abs(v[i]) < rounding ? 0.0 : v[i], digits);
  return text + ")";
}

/// Returns a number with two digits of its standard error, and of six or more as show how it differs.
static std::string ShowSize(double value, double error, double nominal) {
  const auto order = [](double x) { return static_cast<int>(std::floor(std::log10(x))); };
  const double off = std::abs(value - nominal);
  const int most =
      nominal != 0.0 && off > 0.0 ? std::clamp(order(std::abs(nominal)) - order(off) + 3, 6, 15) : 6;
  if (!(error > 0.0) || !std::isfinite(error)) return FormatNumber(value, most);
  const int digits =
      std::abs(value) > 0.0 ? std::clamp(order(std::abs(value)) - order(error) + 2, 1, most) : 1;
  // Less than a hundredth of the error is nothing.
  const double shown = std::abs(value) < 0.01 * error ? 0.0 : value;
  return FormatNumber(shown, digits) + " +- " + FormatNumber(error, 2);
}

std::string Fault::Describe() const {
  if (fault == kUnknownFault) return place;
  const std::string where = place == "law" ? "" : place + ": ", more = detail.empty() ? "" : " " + detail;
  if (std::isnan(value)) return where + fault + more;
  const std::string size = ShowSize(value, error, nominal);
  constexpr std::string_view kFactor = ", factor";
  if (fault.ends_with(kFactor)) {
    // The formula of the part is in JSON.
    const std::string part =
        where + fault.substr(0, std::min(fault.size() - kFactor.size(), fault.find(" (")));
    const bool is_plural = part.ends_with('s') && !part.ends_with("ss");
    const std::string be = is_plural ? " are " : " is ";
    if (value == 0.0) return part + be + "missing" + more;
    const double rounding = std::max(5e-6, 3.0 * error);  // of the six digits that are printed
    if (std::abs(value + 1.0) < rounding)
      return part + (is_plural ? " have" : " has") + " the other sign" + more;
    // Shows how far a factor is from 1, however near it is.
    const double off = std::abs(value - 1.0);
    const int digits = off > 0.0 ? std::clamp(3 - static_cast<int>(std::floor(std::log10(off))), 6, 15) : 6;
    const bool is_near = digits > 6 && off > 3.0 * error;
    return part + be + "multiplied by " + (is_near ? FormatNumber(value, digits) : size) + more;
  }
  const bool is_hidden = std::isinf(error) && (detail.empty() || detail.front() == '(');
  return where + fault + " " + size + Unit(unit) + more +
         (is_hidden ? ", a size that this motion does not show" : "");
}

void Explanation::SetOutcome() {
  for (size_t i = 1; i < faults.size();) {
    const bool again = std::any_of(faults.begin(), faults.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const Fault& one) { return one.IsLike(faults[i]); });
    if (again) {
      faults.erase(faults.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  // A size that nothing shows is no name.
  const bool has_size = faults.empty() || !std::isinf(faults.front().error);
  outcome = faults.size() > 1 || !has_size ? CauseOutcome::kNamedClass : CauseOutcome::kNamed;
}

namespace {

/// ", from 0.2 s", ", 0.2 to 0.5 s"; of what is not seen "between 0.2 and 0.3".
std::string FormatInterval(const Explanation& one) {
  const auto show = [](double earliest, double latest) {
    return latest > earliest ? "between " + FormatNumber(earliest, 4) + " and " + FormatNumber(latest, 4)
                             : FormatNumber(earliest, 4);
  };
  const std::string from = show(one.from - one.unseen_before, one.from);
  if (!one.ends) return ", from " + from + " s";
  return ", " + from + " to " + show(one.to, one.to + one.unseen_after) + " s";
}

}  // namespace

std::string Explanation::Describe() const {
  std::string text;
  if (outcome == CauseOutcome::kNotExplained) {
    text = "not explained";
    if (!faults.empty())
      text += "; nearest: " + faults.front().Describe() + ", which explains " +
              FormatNumber(100.0 * fraction, 3) + " % and leaves " + FormatNumber(left, 3) +
              " times the noise";
  } else {
    for (size_t i = 0; i < std::min(faults.size(), kMostTold); ++i)
      text += (i == 0 ? "" : " or ") + faults[i].Describe();
    if (faults.size() > kMostTold) text += " or " + std::to_string(faults.size() - kMostTold) + " more";
    if (faults.size() > 1) text += " (this motion does not separate them)";
  }
  // A fault that is always there has no begin.
  if (std::isfinite(from)) text += FormatInterval(*this);
  // A rival that is much less likely is of no interest to a reader.
  constexpr double kMostDigits = 3.0;
  const double digits = log_odds / std::log(10.0);
  const bool is_listed = std::ranges::any_of(
      faults, [&](const Fault& fault) { return fault.place + ": " + fault.fault == rival; });
  if (rival.empty() || is_listed || digits > kMostDigits) return text;
  return text + "; " + FormatNumber(std::pow(10.0, std::round(digits))) + " times less likely: " + rival;
}

nlohmann::ordered_json ToJson(const Fault& fault) {
  return {{"fault", fault.fault},          {"place", fault.place}, {"value", fault.value},
          {"standard_error", fault.error}, {"unit", fault.unit},   {"detail", fault.detail}};
}

nlohmann::ordered_json ToJson(const Explanation& one) {
  nlohmann::ordered_json json = {{"text", one.Describe()},
                                 {"channel", NameOf(one.channel)},
                                 {"outcome", NameOf(one.outcome)},
                                 {"faults", nlohmann::ordered_json::array()},
                                 {"from_s", one.from},
                                 {"to_s", one.to},
                                 {"ends", one.ends},
                                 {"unseen_before_s", one.unseen_before},
                                 {"unseen_after_s", one.unseen_after},
                                 {"fraction", one.fraction},
                                 {"left", one.left},
                                 {"rival", one.rival},
                                 {"log_odds", one.log_odds}};
  for (const Fault& fault : one.faults) json["faults"].push_back(ToJson(fault));
  return json;
}

bool Names(const Causes& causes, std::string_view fault) {
  return std::any_of(causes.begin(), causes.end(), [&](const Explanation& one) {
    return one.outcome != CauseOutcome::kNotExplained && one.faults.front().fault == fault;
  });
}

std::string DescribeCauses(const Causes& causes, CauseChannel channel) {
  std::string text;
  for (const Explanation& one : causes)
    if (one.channel == channel) text += (text.empty() ? "" : "; ") + one.Describe();
  return text;
}

}  // namespace dexcheck
