#include <algorithm>
#include <map>
#include <set>

#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

/// Of one convention, or of one number, in each reading that is left.
std::set<std::string> ListIds(const RowFinding& finding) {
  std::set<std::string> ids;
  for (const RowReading& reading : finding.readings) {
    for (const Convention* const convention : reading.conventions) ids.insert(convention->id);
    if (!reading.number.empty()) ids.insert(reading.number);
  }
  return ids;
}

std::string Say(const std::string& noun, bool many, const std::string& words) {
  return noun + (many ? " look " : " looks ") + words;
}

std::string Describe(const std::string& id, const RowFinding& finding, bool many) {
  for (const RowReading& reading : finding.readings) {
    for (const Convention* const convention : reading.conventions) {
      if (convention->id == id) return Say(NameOf(convention->of, many), many, convention->words);
    }
    if (reading.number != id) continue;
    const std::string noun = id.substr(id.find('.') + 1);
    if (id == "zero.offset") return many ? "zeros look offset" : "zero looks " + reading.words;
    return many ? noun + (noun == "axis" ? " numbers differ" : "s differ") : noun + " looks " + reading.words;
  }
  return id;
}

/// What is to be said of rows that share a convention, or a number.
class RowReport {
 public:
  RowReport(const RobotDescription& a, const std::vector<RowFinding>& findings) : a_(a), open_(findings) {}

  std::vector<Finding> Run() {
    while (true) {
      std::map<std::string, std::vector<size_t>> rows_of;
      for (size_t i = 0; i < open_.size(); ++i) {
        for (const std::string& id : ListIds(open_[i])) rows_of[id].push_back(i);
      }
      if (rows_of.empty()) return std::move(found_);
      const auto most = std::ranges::max_element(
          rows_of, [](const auto& x, const auto& y) { return x.second.size() < y.second.size(); });
      Take(rows_of, most->second);
    }
  }

 private:
  static bool Has(const RowReading& reading, const std::string& id) {
    return reading.number == id ||
           std::ranges::any_of(reading.conventions,
                               [&](const Convention* convention) { return convention->id == id; });
  }

  /// One finding of these rows: all ids that explain each of them.
  void Take(const std::map<std::string, std::vector<size_t>>& rows_of, const std::vector<size_t>& rows) {
    Finding finding;
    finding.what = "joint";
    finding.total = a_.spec.joints.size();
    std::string taken;
    for (const auto& entry : rows_of) {
      const std::string& id = entry.first;
      if (entry.second != rows) continue;
      const std::vector<RowReading>& readings = open_[rows[0]].readings;
      const bool is_beside = !taken.empty() && std::ranges::any_of(readings, [&](const RowReading& reading) {
        return Has(reading, id) && Has(reading, taken);
      });
      if (is_beside) continue;  // both at once are two faults
      if (taken.empty()) taken = id;
      finding.ids.push_back(id);
      finding.one.push_back("its " + Describe(id, open_[rows[0]], false));
      finding.many.push_back(Describe(id, open_[rows[0]], true));
    }
    if (rows.size() == 1 && rows[0] > 0) {
      const int parent = a_.spec.joints[rows[0] - 1].parent;
      AddElsewhere(a_, open_[static_cast<size_t>(parent + 1)], parent, &finding);
    }
    for (const size_t i : rows) {
      finding.parts.push_back(i == 0 ? "" : a_.spec.joints[i - 1].name);
      AddValue(taken, i, rows.size(), &finding);
      for (RowReading& reading : open_[i].readings) {
        if (!Has(reading, taken)) reading = RowReading{};
        std::erase_if(reading.conventions,
                      [&](const Convention* convention) { return convention->id == taken; });
        if (reading.number == taken) reading.number.clear();
      }
    }
    finding.cells = rows.size();
    found_.push_back(std::move(finding));
  }

  void AddValue(const std::string& id, size_t row, size_t rows, Finding* finding) const {
    if (rows < 2 || id.find('.') == std::string::npos) return;
    for (const RowReading& reading : open_[row].readings) {
      if (reading.number != id) continue;
      finding->values.push_back("joint " + finding->parts.back() + ": its " +
                                (id == "zero.offset" ? "zero" : id.substr(id.find('.') + 1)) + " looks " +
                                reading.words);
      return;
    }
  }

  const RobotDescription& a_;
  std::vector<RowFinding> open_;
  std::vector<Finding> found_;
};

}  // namespace

void AddElsewhere(const RobotDescription& robot, const RowFinding& row, int joint, Finding* finding) {
  if (finding->ids[0].starts_with("number.")) return;
  RowFinding one;
  one.readings = row.elsewhere;
  const std::string name =
      joint < 0 ? "the base" : "joint " + robot.spec.joints[static_cast<size_t>(joint)].name;
  for (const std::string& id : ListIds(one)) {
    finding->ids.push_back(id);
    finding->one.push_back("that of " + name + ": its " + Describe(id, one, false));
  }
}

std::vector<Finding> ReportRows(const RobotDescription& robot, const std::vector<RowFinding>& rows) {
  return RowReport(robot, rows).Run();
}

}  // namespace dexcheck
