#include "harness/comparison/printed_digits.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <sstream>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using Element = tinyxml2::XMLElement;

/// A number of a file, and whether it is of a body: its mass, centre of mass or inertia.
struct FileNumber : PrintedNumber {
  bool is_of_body = false;
};

/// Returns the text that is printed in the place of a number.
using Replace = std::function<std::string(const FileNumber&, std::string_view text)>;

/// Attributes of URDFs and MJCFs whose numbers describe the mechanism. Inertias of an MJCF are not among
/// them: its compiler refuses those that no body has, and moved numbers of a slender body may be such.
constexpr std::string_view kAttributes[] = {
    "xyz",  "rpy",   "value",  "ixx",     "ixy",       "ixz",        "iyy",          "iyz",
    "izz",  "lower", "upper",  "damping", "friction",  "multiplier", "offset",       "pos",
    "quat", "euler", "xyaxes", "zaxis",   "axisangle", "fromto",     "mass",         "density",
    "size", "axis",  "range",  "ref",     "gravity",   "armature",   "frictionloss", "polycoef"};

bool IsSeparator(char c) { return std::string_view(" \t\n\r,;").find(c) != std::string_view::npos; }

/// A list of numbers with each replaced.
std::string ReplaceNumbers(std::string_view list, bool is_of_body, const Replace& replace) {
  std::string result;
  while (!list.empty()) {
    const bool is_gap = IsSeparator(list.front());
    const size_t length = static_cast<size_t>(
        std::ranges::find_if(list, [&](char c) { return IsSeparator(c) != is_gap; }) - list.begin());
    const std::string_view word = list.substr(0, length);
    const std::optional<PrintedNumber> number = is_gap ? std::nullopt : ReadPrinted(word);
    result += number ? replace({*number, is_of_body}, word) : std::string(word);
    list.remove_prefix(length);
  }
  return result;
}

/// Whether an element is one of these names or stands in one.
bool IsIn(const Element* element, std::initializer_list<std::string_view> names) {
  for (; element != nullptr; element = element->Parent()->ToElement()) {
    if (Contains(names, std::string_view(element->Name()))) return true;
  }
  return false;
}

void ReplaceInXml(Element* root, const Replace& replace) {
  VisitElements(root, [&](Element* element) {
    if (IsIn(element, {"visual", "collision"})) return;
    const bool is_of_body = IsIn(element, {"inertial", "geom"});
    for (const tinyxml2::XMLAttribute* at = element->FirstAttribute(); at != nullptr; at = at->Next()) {
      if (!Contains(kAttributes, std::string_view(at->Name()))) continue;
      element->SetAttribute(at->Name(), ReplaceNumbers(at->Value(), is_of_body, replace).c_str());
    }
  });
}

/// The numbers of a TOML text: neither in strings nor in comments, nor parts of names.
std::string ReplaceInToml(std::string_view text, const Replace& replace) {
  constexpr std::string_view kWord = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_+-.";
  constexpr std::string_view kOfBody[] = {"mass", "com", "inertia"};
  std::string result;
  bool is_of_body = false;
  while (!text.empty()) {
    size_t length = 1;
    const char first = text.front();
    if (first == '#' || first == '"' || first == '\'') {
      const size_t end = text.find(first == '#' ? '\n' : first, 1);
      length = std::min(end, text.size() - 1) + 1;
    } else if (kWord.find(first) != std::string_view::npos) {
      length = std::min(text.find_first_not_of(kWord), text.size());
    }
    const std::string_view word = text.substr(0, length);
    const std::optional<PrintedNumber> number = ReadPrinted(word);
    result += number ? replace({*number, is_of_body}, word) : std::string(word);
    text.remove_prefix(length);
    // The key that stands before its numbers.
    if (!number && std::isalpha(static_cast<unsigned char>(first)) != 0) is_of_body = Contains(kOfBody, word);
  }
  return result;
}

/// The numbers of a table of bodies, below its header.
std::string ReplaceInBodies(const std::string& text, const Replace& replace) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    result += (line.starts_with('#') ? line : ReplaceNumbers(line, true, replace)) + "\n";
  return result;
}

/// Absolute values of numbers, and how often each stands in a file.
using Values = std::map<double, int>;

/// @param exact places that stand in the other file, too.
bool IsExact(const FileNumber& number, const Values& exact) {
  return number.half_unit == 0.0 || (!number.is_of_body && exact.contains(std::abs(number.value)));
}

/// Moves numbers up or down at random, the same way for the same seed.
class Mover {
 public:
  /// @param exact numbers that stay as they are.
  Mover(unsigned seed, const Values& exact) : random_(seed), exact_(exact) {}
  /// By how much this number is moved.
  double Draw(const FileNumber& number) {
    const double sign = (random_() & 1U) != 0 ? 1.0 : -1.0;
    return IsExact(number, exact_) ? 0.0 : sign * number.half_unit;
  }
  Replace AsReplace() {
    return [this](const FileNumber& number, std::string_view text) {
      const double change = Draw(number);
      return change == 0.0 ? std::string(text) : FormatNumber(number.value + change, 17);
    };
  }

 private:
  std::mt19937 random_;
  const Values& exact_;
};

/// Changes the parts of a description; bodies are those of the parts again.
template <typename Change>
void ChangeParts(const mjModel& engine, const std::vector<const Element*>& inertials, RobotDescription* robot,
                 const Change& change) {
  for (size_t body = 1; body < inertials.size(); ++body) {
    const std::string name = NameOf(engine, mjOBJ_BODY, static_cast<int>(body));
    for (DescribedPart& part : robot->parts) {
      if (inertials[body] != nullptr && part.name == name) change(*inertials[body], &part);
    }
  }
  FuseParts(robot);
}

/// By how much the six numbers of a fullinertia, or the three of a diaginertia, are moved.
Matrix3d MoveTensor(const Element& inertial, const char* attribute, Mover* mover) {
  Vector6d entries = Vector6d::Zero();
  int k = 0;
  ReplaceNumbers(ReadAttribute(inertial, attribute), true, [&](const FileNumber& number, std::string_view) {
    if (k < 6) entries[k++] = mover->Draw(number);
    return std::string();
  });
  return ToTensor(entries);
}

/// One file's numbers: an MJCF's mechanism, or a URDF, parameter file or table of bodies as it stands.
class NumberedFile {
 public:
  NumberedFile(const DescriptionFile& file, const UrdfOptions& options)
      : file_(file),
        options_(options),
        is_mjcf_(file.format() == RobotFormat::kMjcf),
        text_(is_mjcf_ ? ReduceToMechanism(file.document()) : file.text()) {
    options_.keep_impossible = true;
  }

  [[nodiscard]] PrintedSpread Draw(int count, const Values& exact) const {
    PrintedSpread spread;
    spread.digits = CountDigits(exact);
    spread.nominal = is_mjcf_ ? ReadMjcf(&spread.undiagonalized) : file_.Describe();
    for (int k = 0; k < count; ++k) {
      std::optional<RobotDescription> moved = ReadMoved(Mover(static_cast<unsigned>(k), exact));
      if (moved) spread.draws.push_back(*std::move(moved));
    }
    return spread;
  }

  [[nodiscard]] Values ListValues() const {
    Values values;
    Visit([&](const FileNumber& number) {
      if (!number.is_of_body) ++values[std::abs(number.value)];
    });
    return values;
  }

 private:
  /// Returns the text with the numbers replaced that describe the mechanism, but for inertias of an MJCF.
  [[nodiscard]] std::string ReplaceAll(const Replace& replace) const {
    if (file_.format() == RobotFormat::kToml) return ReplaceInToml(text_, replace);
    if (file_.format() == RobotFormat::kBodies) return ReplaceInBodies(text_, replace);
    tinyxml2::XMLDocument document;
    ParseXml(text_, file_.path().string(), &document);
    ReplaceInXml(document.RootElement(), replace);
    return PrintXml(document);
  }

  /// Visits all numbers that describe the mechanism.
  void Visit(const std::function<void(const FileNumber&)>& visit) const {
    const Replace look = [&](const FileNumber& number, std::string_view text) {
      visit(number);
      return std::string(text);
    };
    if (is_mjcf_) {
      const MjcfFile mjcf(text_, file_.path().string());
      VisitElements(mjcf.root(), [&](Element* element) {
        for (const char* attribute : {"diaginertia", "fullinertia"})
          ReplaceNumbers(ReadAttribute(*element, attribute), true, look);
      });
    }
    static_cast<void>(ReplaceAll(look));
  }

  [[nodiscard]] PrintedDigits CountDigits(const Values& exact) const {
    PrintedDigits digits;
    Visit([&](const FileNumber& number) {
      if (IsExact(number, exact)) return;
      digits.fewest = digits.count == 0 ? number.digits : std::min(digits.fewest, number.digits);
      digits.most = Worst(digits.most, number.digits);
      ++digits.count;
    });
    return digits;
  }

  /// @param undiagonalized PrintedSpread::undiagonalized.
  RobotDescription ReadMjcf(std::optional<RobotDescription>* undiagonalized) const {
    const std::string source = file_.path().string();
    const MjcfFile mjcf(text_, source);
    const MjModelPtr engine = LoadMjcfText(text_, source);
    RobotDescription robot = ReadMjcfDescription(*engine, source);
    RobotDescription stated = robot;
    bool has_tensor = false;
    ChangeParts(*engine, ListInertials(mjcf, *engine), &stated,
                [&](const Element& inertial, DescribedPart* part) {
                  const std::optional<Matrix3d> tensor = ReadFullInertia(inertial, part->body.inertia);
                  if (!tensor) return;
                  has_tensor = true;
                  part->body.inertia = *tensor;
                });
    if (has_tensor) *undiagonalized = std::move(stated);
    return robot;
  }

  /// Reads the file with its numbers moved; none where that is no robot.
  [[nodiscard]] std::optional<RobotDescription> ReadMoved(Mover mover) const {
    const std::string text = ReplaceAll(mover.AsReplace());
    if (!is_mjcf_) {
      try {
        DescriptionFile moved(file_.path(), text, options_);
        if (file_.carrier()) moved.PlaceOn(*file_.carrier());
        return moved.Describe();
      } catch (const InputError&) {
        return std::nullopt;  // a parameter file's bodies must be some: of a slender one that may fail
      }
    }
    const std::string source = file_.path().string();
    const MjModelPtr engine = LoadMjcfText(text, source);
    RobotDescription robot = ReadMjcfDescription(*engine, source);
    ChangeParts(*engine, ListInertials(MjcfFile(text_, source), *engine), &robot,
                [&](const Element& inertial, DescribedPart* part) {
                  const Matrix3d R = part->X_LC.linear();
                  part->body.inertia += R * MoveTensor(inertial, "diaginertia", &mover) * R.transpose();
                  part->body.inertia += MoveTensor(inertial, "fullinertia", &mover);
                });
    return robot;
  }

  const DescriptionFile& file_;
  UrdfOptions options_;
  bool is_mjcf_;
  std::string text_;
};

}  // namespace

std::optional<std::array<PrintedSpread, 2>> DrawWithinDigits(
    const std::array<const DescriptionFile*, 2>& files, const UrdfOptions& options, int count) {
  std::array<PrintedSpread, 2> spreads;
  try {
    const std::array<NumberedFile, 2> numbered = {NumberedFile(*files[0], options),
                                                  NumberedFile(*files[1], options)};
    const std::array<Values, 2> values = {numbered[0].ListValues(), numbered[1].ListValues()};
    for (size_t i = 0; i < 2; ++i) {
      // Those that stand in the other file as often at least.
      Values exact = values[i];
      std::erase_if(exact, [&](const auto& value) {
        const auto other = values[1 - i].find(value.first);
        return other == values[1 - i].end() || other->second < value.second;
      });
      spreads[i] = numbered[i].Draw(count, exact);
      spreads[i].digits.file = files[i]->path().filename().string();
      if (spreads[i].draws.empty()) return std::nullopt;
    }
  } catch (const InputError&) {
    return std::nullopt;
  }
  return spreads;
}

}  // namespace dexcheck
