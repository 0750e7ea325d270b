#include "controller/common/toml_reader.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr size_t kMaxNameLength = 64;
constexpr std::string_view kNameLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";
constexpr std::string_view kNameRule = "a name of 1 to 64 letters, digits, and _ - .";
constexpr size_t kMaxKeyLength = 256;
constexpr std::string_view kKeyRule = "a name of 1 to 256 bytes without control characters";

bool IsName(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameLength &&
         text.find_first_not_of(kNameLetters) == std::string_view::npos;
}

/// Keys name parts of robots too, which other formats name as they like.
bool IsKey(std::string_view text) {
  return !text.empty() && text.size() <= kMaxKeyLength &&
         std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

std::string Format(const toml::node& node);

std::string FormatList(const toml::array& list) {
  std::string text = "[";
  for (const toml::node& entry : list) {
    if (text.size() > 1) text += ", ";
    text += Format(entry);
    if (Abbreviate(text) != text) break;
  }
  return text + "]";
}

std::string FormatTable(const toml::table& table) {
  std::string text = "{";
  for (const auto& [key, entry] : table) {
    text += (text.size() > 1 ? ", " : " ") + std::string(key.str()) + " = " + Format(entry);
    if (Abbreviate(text) != text) break;
  }
  return text + " }";
}

/// The value as it might stand in the file, on one line.
std::string Format(const toml::node& node) {
  if (const auto text = node.value_exact<std::string_view>()) return Quote(*text);
  if (const auto integer = node.value_exact<int64_t>()) return std::to_string(*integer);
  if (const auto number = node.value_exact<double>()) return FormatNumber(*number);
  if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
  if (const toml::array* list = node.as_array()) return FormatList(*list);
  return node.is_table() ? "a table" : "a date or time";
}

}  // namespace

void TomlContext::RejectMissing() const {
  constexpr size_t kMostTables = 20;  // that one line names
  if (missing.empty()) return;
  // In the file's order; what does not come from the file is last.
  std::vector<MissingKeys> sorted = missing;
  std::ranges::stable_sort(sorted, [](const MissingKeys& a, const MissingKeys& b) {
    return a.line != 0 && (b.line == 0 || a.line < b.line);
  });
  std::string text;
  for (const MissingKeys& keys : sorted) {
    if (&keys - sorted.data() == kMostTables) {
      text += "; and more in " + std::to_string(sorted.size() - kMostTables) + " other places";
      break;
    }
    const bool is_first = text.empty();
    const std::string where = is_first || keys.line == 0 ? keys.where : "line " + std::to_string(keys.line);
    text += (is_first ? "" : "; ") + where + ": " + (keys.path.empty() ? "" : Abbreviate(keys.path) + ": ");
    if (keys.names.empty()) {
      text += keys.problem;
      continue;
    }
    text += "missing key ";
    for (const std::string& name : keys.names)
      text += (&name == &keys.names.front() ? "" : ", ") + Quote(name);
  }
  throw InputError(text);
}

TomlValue::TomlValue(const TomlContext& context, const toml::node& node, std::string path)
    : context_(&context), node_(&node), path_(std::move(path)) {}

TomlValue TomlValue::StandIn(const TomlContext& context, const toml::node& node, std::string path) {
  TomlValue value(context, node, std::move(path));
  value.is_missing_ = true;
  return value;
}

std::string TomlValue::Show() const {
  const toml::table* table = node_->as_table();
  return Abbreviate(table != nullptr ? FormatTable(*table) : Format(*node_));
}

int TomlValue::line() const { return static_cast<int>(node_->source().begin.line); }

bool TomlValue::IsBefore(const TomlValue& other) const {
  const toml::source_position a = node_->source().begin;
  const toml::source_position b = other.node_->source().begin;
  return std::pair(a.line, a.column) < std::pair(b.line, b.column);
}

void TomlValue::Fail(std::string_view requirement) const {
  Reject(std::string(requirement) + ", got " + Abbreviate(Format(*node_)));
}

std::string TomlValue::Locate() const {
  // A value that was overridden has its own source, which says where it comes from better than a line does.
  const toml::source_path_ptr& own_source = node_->source().path;
  if (own_source) return *own_source;
  // A table that an override made stands on no line.
  return line() > 0 ? context_->source + ":" + std::to_string(line()) : context_->source;
}

void TomlValue::Reject(std::string_view problem) const {
  context_->RejectMissing();
  const std::string key = path_.empty() ? "" : Abbreviate(path_) + ": ";
  throw InputError(Locate() + ": " + key + std::string(problem));
}

MissingKeys& TomlValue::Note(const std::string& problem) const {
  const bool is_own = node_->source().path != nullptr;
  MissingKeys note{Locate(), is_own ? 0 : line(), path_, {}, problem};
  std::vector<MissingKeys>& all = context_->missing;
  // A template of two arms is read twice, and notes its keys once.
  const auto same = std::ranges::find_if(all, [&](const MissingKeys& other) {
    return other.where == note.where && other.path == note.path && other.problem == problem;
  });
  return same == all.end() ? all.emplace_back(std::move(note)) : *same;
}

void TomlValue::NoteMissing(const std::string& key) const {
  std::vector<std::string>& names = Note("").names;
  if (std::ranges::find(names, key) == names.end()) names.push_back(key);
}

void TomlValue::NoteMisspelt(const std::string& key) const {
  Note("unknown key, did you mean " + Quote(key) + "?");
}

double TomlValue::AsNumber() const {
  if (is_missing_) return 1.0;
  if (!node_->is_number() && !node_->is_string()) Fail("must be a number");
  if (node_->is_number()) {
    // value<double>() has none where a whole number does not fit a double exactly.
    const auto whole = node_->value_exact<int64_t>();
    const double value = whole ? static_cast<double>(*whole) : node_->value_exact<double>().value();
    if (!std::isfinite(value)) Fail("must be finite");
    return value;
  }
  try {
    const double value = EvaluateExpression(AsText(), context_->symbols);
    if (!std::isfinite(value)) Fail("must be finite, is " + FormatNumber(value));
    return value;
  } catch (const std::invalid_argument& error) {
    Fail(std::string("must be a number or arithmetic, ") + error.what());
  }
}

double TomlValue::AsPositive() const {
  const double value = AsNumber();
  if (value <= 0.0) Fail("must be positive");
  return value;
}

double TomlValue::AsNotNegative() const {
  const double value = AsNumber();
  if (value < 0.0) Fail("must not be negative");
  return value;
}

long TomlValue::AsWhole(long least, long most) const {
  if (is_missing_) return std::clamp(1L, least, most);
  const auto value = node_->value_exact<int64_t>();
  if (!value || *value < least || *value > most) {
    Fail("must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return *value;
}

bool TomlValue::AsFlag() const {
  if (is_missing_) return false;
  const auto value = node_->value_exact<bool>();
  if (!value) Fail("must be true or false");
  return *value;
}

std::string TomlValue::AsText() const {
  if (is_missing_) return "missing";
  if (!IsText()) Fail("must be text");
  return **node_->as_string();
}

std::string TomlValue::AsName() const {
  std::string name = AsText();
  if (!IsName(name)) Fail("must be " + std::string(kNameRule));
  return name;
}

std::string TomlValue::AsPartName() const {
  std::string name = AsText();
  if (!IsKey(name)) Fail("must be " + std::string(kKeyRule));
  return name;
}

std::vector<TomlValue> TomlValue::AsList() const {
  if (is_missing_) return {};
  const toml::array* list = node_->as_array();
  if (list == nullptr) Fail("must be a list");
  std::vector<TomlValue> entries;
  for (const toml::node& entry : *list) {
    entries.emplace_back(*context_, entry, path_ + "[" + std::to_string(entries.size()) + "]");
  }
  return entries;
}

TomlTable TomlValue::AsTable() const {
  static const toml::table kNothing;
  if (is_missing_) return {*context_, *this, kNothing, /*is_missing=*/true};
  const toml::table* table = node_->as_table();
  if (table == nullptr) Fail("must be a table");
  return {*context_, *this, *table};
}

void TomlValue::CopyNumbers(double* target, int count) const {
  if (is_missing_) {
    std::fill_n(target, count, 1.0);
    return;
  }
  const std::vector<TomlValue> entries = AsList();
  if (entries.size() != static_cast<size_t>(count)) {
    Fail("must be a list of " + std::to_string(count) + " numbers");
  }
  for (const TomlValue& entry : entries) *target++ = entry.AsNumber();
}

TomlTable::TomlTable(const TomlContext& context, TomlValue self, const toml::table& table, bool is_missing)
    : context_(&context), self_(std::move(self)), table_(&table), is_missing_(is_missing) {}

std::string TomlTable::MakePath(std::string_view key) const {
  return (self_.path().empty() ? "" : self_.path() + ".") + std::string(key);
}

TomlValue TomlTable::MakeValue(std::string_view key, const toml::node& node) const {
  return {*context_, node, MakePath(key)};
}

std::optional<TomlValue> TomlTable::Find(std::string_view key) {
  requested_.emplace(key);
  const toml::node* node = table_->get(key);
  if (node == nullptr) return std::nullopt;
  return MakeValue(key, *node);
}

TomlValue TomlTable::Get(std::string_view key) {
  std::optional<TomlValue> value = Find(key);
  return value ? *std::move(value) : Miss(key);
}

std::vector<std::pair<std::string, TomlValue>> TomlTable::ListInFileOrder() const {
  std::vector<std::pair<std::string, TomlValue>> entries;
  for (const auto& [key, node] : *table_) entries.emplace_back(key.str(), MakeValue(key.str(), node));
  std::ranges::sort(entries, [](const auto& a, const auto& b) { return a.second.IsBefore(b.second); });
  return entries;
}

std::vector<std::pair<std::string, TomlValue>> TomlTable::GetEntries() {
  std::vector<std::pair<std::string, TomlValue>> entries = ListInFileOrder();
  for (const auto& [key, value] : entries) {
    if (!IsKey(key)) value.Reject("must have " + std::string(kKeyRule));
    requested_.insert(key);
  }
  return entries;
}

std::pair<std::optional<TomlValue>, double> TomlTable::FindWithAngleUnit(const std::string& key) {
  RejectTogether(key, {key + "_deg"});
  if (std::optional<TomlValue> degrees = Find(key + "_deg")) return {std::move(degrees), DegToRad(1.0)};
  return {Find(key), 1.0};
}

double TomlTable::GetAngle(const std::string& key) {
  const auto [value, unit] = FindWithAngleUnit(key);
  return unit * (value ? *value : Miss(key + "_deg")).AsNumber();
}

void TomlTable::RejectUnknown(const TomlValue& value, const std::string& nearest) const {
  if (!nearest.empty()) value.Reject("unknown key, did you mean " + Quote(nearest) + "?");
  std::string known;
  for (const std::string& key : requested_) known += (known.empty() ? "" : ", ") + key;
  value.Reject("unknown key, known here are " + known);
}

void TomlTable::RejectTogether(std::string_view key, std::initializer_list<std::string_view> others) const {
  if (!table_->contains(key)) return;
  for (const std::string_view other : others) {
    if (const toml::node* node = table_->get(other)) {
      MakeValue(other, *node).Reject("must not stand beside " + Quote(key));
    }
  }
}

void TomlTable::RejectUnused() const {
  for (const auto& [key, value] : ListInFileOrder()) {
    if (!requested_.contains(key))
      RejectUnknown(value, FindNearest(key, {requested_.begin(), requested_.end()}));
  }
}

void TomlTable::RejectOthersThan(std::initializer_list<std::string_view> keys) {
  requested_.insert(keys.begin(), keys.end());
  RejectUnused();
}

TomlValue TomlTable::Miss(std::string_view key) {
  const std::string missing(key);
  TomlValue stand_in = TomlValue::StandIn(*context_, *table_, MakePath(key));
  if (is_missing_) return stand_in;
  for (const auto& [unused, value] : ListInFileOrder()) {
    if (requested_.contains(unused) || FindNearest(unused, {missing}).empty()) continue;
    value.NoteMisspelt(missing);
    requested_.insert(unused);
    return stand_in;
  }
  self_.NoteMissing(missing);
  return stand_in;
}

}  // namespace dexcheck
