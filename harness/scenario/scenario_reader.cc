#include "harness/scenario/scenario_reader.h"

namespace dexcheck {

double ReadNumber(const TomlValue& value, Range range) {
  if (range == Range::kAny) return value.AsNumber();
  return range == Range::kPositive ? value.AsPositive() : value.AsNotNegative();
}

void ReadValue(const TomlValue& value, Range range, double* target) { *target = ReadNumber(value, range); }

void ReadValue(const TomlValue& value, Range range, std::optional<double>* target) {
  *target = ReadNumber(value, range);
}

void ReadValue(const TomlValue& value, Range /*range*/, bool* target) { *target = value.AsFlag(); }

void ReadValue(const TomlValue& value, Range range, ByName* target) {
  target->key = value.path();
  if (!value.IsTable()) {
    target->all = ReadNumber(value, range);
    return;
  }
  for (const auto& [name, entry] : value.AsTable().GetEntries()) {
    target->groups.emplace_back(name, ReadNumber(entry, range));
  }
}

void ReadValue(const TomlValue& value, Range /*range*/, Vector3d* target) { *target = value.AsVector<3>(); }

void ReadValue(const TomlValue& value, Range /*range*/, std::vector<std::string>* target) {
  for (const TomlValue& entry : value.AsList()) target->push_back(entry.AsName());
}

}  // namespace dexcheck
