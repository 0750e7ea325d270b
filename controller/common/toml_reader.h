#pragma once

// Typed access to TOML files, with errors that name file, line, key and value.
//
//   TomlDocument document(text, "robot.toml");
//   TomlTable root = document.Open();
//   const double radius = root.Get("radius").AsPositive();
//   root.RejectUnused();  // A key that nobody requested is misspelt.
//
// A key that is missing does not end the reading: something stands in for it, so that TomlDocument::Read can
// report all that are missing at once.

#include <toml++/toml.h>

#include <exception>
#include <initializer_list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/common/expression.h"
#include "controller/common/types.h"

namespace dexcheck {

/// Keys that one table does not have, or has misspelt.
struct MissingKeys {
  std::string where;               ///< "FILE:LINE".
  int line = 0;                    ///< 0 for what does not come from the file.
  std::string path;                ///< Of the table; empty at the top.
  std::vector<std::string> names;  ///< Empty for a misspelt key, which `problem` describes.
  std::string problem;
};

/// Data that all values of one file share.
struct TomlContext {
  std::string source;                        ///< The file, for messages.
  SymbolTable symbols;                       ///< For quoted arithmetic.
  mutable std::vector<MissingKeys> missing;  ///< So far.

  /// Throws InputError, one line with all keys that are missing so far; without any it does nothing.
  void RejectMissing() const;
};

class TomlTable;

/// One value of a file and the dotted path that leads to it. Lives as long as its document.
/// Every function that cannot deliver throws InputError, one line "FILE:LINE: PATH: what, got VALUE"; when
/// keys have been found missing before, the line names those instead.
class TomlValue {
 public:
  TomlValue(const TomlContext& context, const toml::node& node, std::string path);
  /// Stands in for a key that is missing in the table at `node`: 1, false, "missing", the first choice, or
  /// an empty list or table.
  static TomlValue StandIn(const TomlContext& context, const toml::node& node, std::string path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int line() const;

  /// Number, or quoted arithmetic over the document's symbols; finite.
  [[nodiscard]] double AsNumber() const;
  [[nodiscard]] double AsPositive() const;
  [[nodiscard]] double AsNotNegative() const;
  /// Whole number from `least` to `most`.
  [[nodiscard]] long AsWhole(long least, long most) const;
  /// true or false.
  [[nodiscard]] bool AsFlag() const;
  [[nodiscard]] bool IsText() const { return node_->is_string(); }
  [[nodiscard]] bool IsTable() const { return node_->is_table(); }
  /// The value as TOML on one line.
  [[nodiscard]] std::string Show() const;
  [[nodiscard]] std::string AsText() const;
  /// Text that can name a thing: 1 to 64 of the letters A-Z, a-z, digits, and _ - .
  [[nodiscard]] std::string AsName() const;
  /// A name of a joint, link or frame, as other formats allow it: 1 to 256 bytes without control characters.
  [[nodiscard]] std::string AsPartName() const;
  [[nodiscard]] std::vector<TomlValue> AsList() const;
  [[nodiscard]] TomlTable AsTable() const;

  /// List of exactly N numbers.
  template <int N>
  [[nodiscard]] Eigen::Matrix<double, N, 1> AsVector() const {
    Eigen::Matrix<double, N, 1> vector;
    CopyNumbers(vector.data(), N);
    return vector;
  }

  /// List of exactly N numbers, or one number for all of them.
  template <int N>
  [[nodiscard]] Eigen::Matrix<double, N, 1> AsVectorOrNumber() const {
    if (!node_->is_array()) return Eigen::Matrix<double, N, 1>::Constant(AsNumber());
    return AsVector<N>();
  }

  /// The choice that the list pairs with this value's text.
  template <typename T>
  [[nodiscard]] T AsChoice(std::initializer_list<std::pair<std::string_view, T>> choices) const {
    if (is_missing_) return choices.begin()->second;
    const std::string text = AsText();
    std::string known;
    for (const auto& [name, choice] : choices) {
      if (name == text) return choice;
      known += (known.empty() ? "" : ", ") + ('"' + std::string(name) + '"');
    }
    Fail("must be one of " + known);
  }

  /// Whether this stands before the other in the file.
  [[nodiscard]] bool IsBefore(const TomlValue& other) const;

  /// Throws "FILE:LINE: PATH: requirement, got VALUE".
  [[noreturn]] void Fail(std::string_view requirement) const;
  /// Throws "FILE:LINE: PATH: problem".
  [[noreturn]] void Reject(std::string_view problem) const;
  /// Notes that this table lacks a key.
  void NoteMissing(const std::string& key) const;
  /// Notes that this value's key looks like a misspelling of another one.
  void NoteMisspelt(const std::string& key) const;

 private:
  void CopyNumbers(double* target, int count) const;
  /// The note of this problem with this value, made when there is none yet.
  MissingKeys& Note(const std::string& problem) const;
  /// "FILE:LINE", or where the value was set.
  [[nodiscard]] std::string Locate() const;

  const TomlContext* context_;
  const toml::node* node_;
  std::string path_;
  bool is_missing_ = false;
};

/// A table that keeps track of the keys that were requested.
class TomlTable {
 public:
  /// @param is_missing the table is not there, so that nothing is missing in it.
  TomlTable(const TomlContext& context, TomlValue self, const toml::table& table, bool is_missing = false);

  /// The value under a key that must be there.
  TomlValue Get(std::string_view key);
  /// The value under a key that may be missing.
  std::optional<TomlValue> Find(std::string_view key);
  /// A function of TomlValue reads that value.
  template <typename T>
  std::optional<T> Find(std::string_view key, T (TomlValue::*as)() const) {
    const std::optional<TomlValue> value = Find(key);
    return value ? std::optional<T>(((*value).*as)()) : std::nullopt;
  }
  /// The entries of the list under a key; none when it is missing.
  std::vector<TomlValue> FindList(std::string_view key) {
    return Find(key, &TomlValue::AsList).value_or(std::vector<TomlValue>());
  }
  /// All keys and values in the file's order, for a table whose keys are names of the user's choice.
  std::vector<std::pair<std::string, TomlValue>> GetEntries();

  /// The angle under `key` in rad, or under `key`_deg in degrees. @return rad.
  double GetAngle(const std::string& key);
  /// The list of N angles under `key` in rad, or under `key`_deg in degrees. @return rad.
  template <int N>
  std::optional<Eigen::Matrix<double, N, 1>> FindAngles(const std::string& key) {
    const auto [value, unit] = FindWithAngleUnit(key);
    if (!value) return std::nullopt;
    return unit * value->template AsVector<N>();
  }
  /// The value under `key` or `key`_deg, not both, and its unit in rad.
  std::pair<std::optional<TomlValue>, double> FindWithAngleUnit(const std::string& key);

  /// Throws when a key stands in the table together with one of those that would say the same in another way.
  void RejectTogether(std::string_view key, std::initializer_list<std::string_view> others) const;
  /// Throws at the first key that was never requested, with the nearest that was.
  void RejectUnused() const;
  /// Throws at the first key that is not one of these.
  void RejectOthersThan(std::initializer_list<std::string_view> keys);
  /// Notes that a key is missing, or that an unused key looks like a misspelling of it. @return what stands
  /// in for it.
  TomlValue Miss(std::string_view key);

 private:
  [[nodiscard]] std::string MakePath(std::string_view key) const;
  [[nodiscard]] TomlValue MakeValue(std::string_view key, const toml::node& node) const;
  [[nodiscard]] std::vector<std::pair<std::string, TomlValue>> ListInFileOrder() const;
  [[noreturn]] void RejectUnknown(const TomlValue& value, const std::string& nearest) const;

  const TomlContext* context_;
  TomlValue self_;
  const toml::table* table_;
  bool is_missing_;
  std::set<std::string, std::less<>> requested_;
};

/// A parsed file.
class TomlDocument {
 public:
  /// Largest file accepted, bytes.
  static constexpr size_t kMaxSize = size_t{1} << 20U;

  /// @param source the file's name, for messages.
  /// @throws InputError for text that is not TOML, is too long, or is nested too deeply.
  TomlDocument(std::string_view text, std::string_view source);
  /// A copy has the same values, but knows the lines of none.
  TomlDocument(const TomlDocument& other);
  TomlDocument& operator=(const TomlDocument&) = delete;
  TomlDocument(TomlDocument&&) = default;
  TomlDocument& operator=(TomlDocument&&) = default;
  ~TomlDocument() = default;

  [[nodiscard]] TomlTable Open() const;
  /// Returns what `function` returns for the whole file. Missing keys are reported before anything it throws.
  template <typename Function>
  auto Read(const Function& function) const {
    try {
      auto result = function(Open());
      context_->RejectMissing();
      return result;
    } catch (const std::exception&) {
      context_->RejectMissing();
      throw;
    }
  }
  /// Throws when keys were missing so far.
  void RejectMissing() const { context_->RejectMissing(); }
  /// Sets a value in place of the file's by an assignment "PATH=VALUE"; tables on the way are made. Whole
  /// numbers in the path count the entries of lists, from 0. A value that is not TOML is taken as text.
  /// @throws InputError when this is no assignment, or its path leads through what is no table or list.
  void Override(std::string_view assignment);
  /// Sets a number in place of the file's, at a path as Override takes it. @throws InputError as Override.
  void Set(std::string_view path, double number);
  /// Adds a symbol to those that quoted arithmetic may use from now on.
  void Define(const std::string& symbol, double value) { context_->symbols[symbol] = value; }

 private:
  // Behind pointers, so that values stay valid when the document moves.
  std::unique_ptr<TomlContext> context_;
  std::unique_ptr<toml::table> root_;
};

/// The text as a string of TOML, on one line; bytes that are no UTF-8 become '?'.
std::string QuoteToml(std::string_view text);

/// The text of a file. @throws InputError when it cannot be read or is longer than TomlDocument::kMaxSize.
std::string ReadTextFile(const std::string& path);

/// TOML text with assignments made in it, as TomlDocument::Override makes them; its comments are lost. The
/// same text when there are none.
/// @param source the text's file, for messages. @throws InputError as TomlDocument.
std::string ApplyOverrides(const std::string& text, const std::string& source,
                           const std::vector<std::string>& overrides);

}  // namespace dexcheck
