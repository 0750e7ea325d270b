#pragma once

// What results of checks come to: by category, as JSON.

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "harness/base/check_record.h"

namespace dexcheck {

/// In the order in which they are shown.
inline constexpr std::array<CheckCategory, 5> kCheckCategories = {
    CheckCategory::kModel, CheckCategory::kLaw, CheckCategory::kInverseDynamics,
    CheckCategory::kForwardDynamics, CheckCategory::kAssumption};

/// "Inverse dynamics": NameOf at the beginning of a line.
const char* TitleOf(CheckCategory category);

/// A value as a fraction of its bound; 0 for 0 / 0, infinite for anything else over 0.
double CalcFraction(double value, double bound);
inline double CalcFraction(const CheckRecord& check) { return CalcFraction(check.worst, check.bound); }

/// Whether a check was evaluated at each step, and not once, as a constant is.
inline bool IsTimed(const CheckRecord& check) { return check.count > 0; }

/// As summaries and pages have it: kind, max, bound, unit, pass, where, description; and of a check that was
/// evaluated at each step (`timed`) rms, at_time_s and failed_at_s.
nlohmann::ordered_json ToJson(const CheckRecord& record, bool timed);
/// The same back; JSON has no infinity, which is written as null. @throws nlohmann::json::exception.
CheckRecord ReadCheck(const std::string& name, const nlohmann::json& json);

/// Where one of the categories stands: the check that is nearest to its bound, or farthest beyond.
struct CategoryStatus {
  explicit CategoryStatus(CheckCategory of = CheckCategory::kModel) : category(of) {}

  CheckCategory category;
  std::string check;
  double worst = 0.0;
  double bound = 0.0;
  long checks = 0;  ///< None when the run has no check of this category.
  long failed = 0;  ///< Of these.

  void Add(const std::string& name, double value, double its_bound, bool fails);
  [[nodiscard]] bool is_asked() const { return checks > 0; }
  [[nodiscard]] double fraction() const { return CalcFraction(worst, bound); }
};

}  // namespace dexcheck
