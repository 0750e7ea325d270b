// Faults of bodies: each is undone, and the result is compared with what would be right.

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/body_faults.h"
#include "harness/descriptions/join_names.h"

namespace dexcheck {
namespace {

/// Seven digits: what a person reads of a body.
std::string Describe(const MassProperties& body) {
  const Matrix3d I = body.inertia + Matrix3d::Zero();  // no -0
  const Vector3d c = body.com + Vector3d::Zero();
  return fmt::format(
      "mass {:.7g}, com [{:.7g}, {:.7g}, {:.7g}], inertia [{:.7g}, {:.7g}, {:.7g}, {:.7g}, {:.7g}, {:.7g}]",
      body.mass, c[0], c[1], c[2], I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
}

class BodySearch {
 public:
  BodySearch(const std::vector<ComparedBody>& bodies, double length, double tolerance)
      : bodies_(bodies), length_(length), tolerance_(tolerance), is_open_(bodies.size(), false) {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      const BodyDifference difference = CompareBodies(bodies_[i].given, bodies_[i].right, length_);
      is_open_[i] = difference.largest() > tolerance_;
      squares_ += difference.squares();
      count_ += bodies_[i].given.mass > 0.0 || bodies_[i].right.mass > 0.0 ? 1 : 0;
    }
  }

  std::vector<Hypothesis> Run() {
    FindShiftedLists();
    // One fault of many links is likelier than many exchanges: left and right are mirrored, and a wrong
    // sign makes one of the other.
    constexpr size_t kMany = 3;
    const std::vector<BodyFault> faults = ListBodyFaults();
    FindFaults(faults, kMany);
    FindExchanges();
    FindFaults(faults, 1);
    FindLostParts();
    FindPartFaults();
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool IsRight(size_t i, const MassProperties& body) const {
    return CompareBodies(body, bodies_[i].right, length_).largest() <= tolerance_;
  }

  /// Whether the link is right with the fault undone, as a whole or in each of its parts, of which as many
  /// must show it: what one link's one part explains is a fault of that part.
  [[nodiscard]] bool Explains(const BodyFault& fault, size_t i, int fewest_parts) const {
    const std::optional<MassProperties> undone = fault.undo(bodies_[i]);
    if (undone && IsRight(i, *undone)) return true;
    const std::optional<MassProperties> in_parts = UndoInAllParts(fault, bodies_[i], fewest_parts);
    return in_parts && IsRight(i, *in_parts);
  }

  void Add(const std::string& text, const std::vector<size_t>& links) {
    constexpr size_t kMostValues = 3;
    Hypothesis hypothesis;
    hypothesis.text = text;
    for (const size_t i : links) {
      is_open_[i] = false;
      if (squares_ > 0.0) {
        hypothesis.explained +=
            CompareBodies(bodies_[i].given, bodies_[i].right, length_).squares() / squares_;
      }
      if (hypothesis.values.size() == kMostValues) continue;
      hypothesis.values.push_back("link " + bodies_[i].link + ": " + Describe(bodies_[i].given) +
                                  "; right would be " + Describe(bodies_[i].right));
    }
    found_.push_back(std::move(hypothesis));
  }

  [[nodiscard]] std::string ListLinks(const std::vector<size_t>& links) const {
    std::vector<std::string> names;
    for (const size_t i : links) names.push_back(bodies_[i].link);
    return JoinNames(names);
  }

  [[nodiscard]] std::vector<size_t> ListOpen() const {
    std::vector<size_t> open;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (is_open_[i]) open.push_back(i);
    }
    return open;
  }

  /// The fault that explains most links comes first; of two that explain the same ones, the first.
  /// @param fewest links that a fault must explain.
  void FindFaults(const std::vector<BodyFault>& faults, size_t fewest) {
    while (true) {
      const std::vector<size_t> open = ListOpen();
      std::vector<size_t> best;
      const BodyFault* cause = nullptr;
      for (const BodyFault& fault : faults) {
        std::vector<size_t> links;
        for (const size_t i : open) {
          if (Explains(fault, i, fewest > 1 ? 1 : 2)) links.push_back(i);
        }
        if (links.size() <= best.size()) continue;
        best = links;
        cause = &fault;
      }
      if (cause == nullptr || best.size() < fewest) return;
      if (best.size() == 1) {
        Add("link " + bodies_[best[0]].link + ": its " + cause->noun + " looks " + cause->text, best);
      } else {
        const bool is_all = best.size() == open.size() && open.size() * 2 > count_;
        Add((is_all ? "all " : "") + cause->plural + " look " + cause->text + ": " +
                std::to_string(best.size()) + " of " + std::to_string(count_) + " links" +
                (is_all ? "" : " (" + ListLinks(best) + ")"),
            best);
      }
    }
  }

  /// Each body is that of the next joint, or of the one before.
  void FindShiftedLists() {
    for (const int shift : {1, -1}) {
      std::vector<size_t> links;
      for (const size_t i : ListOpen()) {
        const long other = static_cast<long>(i) + shift;
        if (other < 0 || other >= static_cast<long>(bodies_.size())) continue;
        if (IsSame(bodies_[i].given, bodies_[static_cast<size_t>(other)].right)) links.push_back(i);
      }
      constexpr size_t kFewest = 3;  // two may be an exchange
      if (links.size() < kFewest || 2 * links.size() < ListOpen().size()) continue;
      // The one at the end of the list has no other to be.
      for (const size_t i : ListOpen()) {
        if (std::find(links.begin(), links.end(), i) == links.end()) links.push_back(i);
      }
      Add(std::string("the list of bodies looks shifted by one: each link has the body of the ") +
              (shift > 0 ? "next" : "one before") + ", " + std::to_string(links.size()) + " of " +
              std::to_string(count_) + " links",
          links);
      return;
    }
  }

  [[nodiscard]] bool IsSame(const MassProperties& a, const MassProperties& b) const {
    return CompareBodies(a, b, length_).largest() <= tolerance_;
  }

  void FindExchanges() {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      for (size_t j = i + 1; j < bodies_.size(); ++j) {
        if (!is_open_[i] || !is_open_[j]) continue;
        const MassProperties& a = bodies_[i].given;
        const MassProperties& b = bodies_[j].given;
        const std::pair<const char*, std::pair<MassProperties, MassProperties>> exchanges[] = {
            {"bodies", {b, a}},
            {"masses", {{b.mass, a.com, a.inertia}, {a.mass, b.com, b.inertia}}},
            {"centres of mass", {{a.mass, b.com, a.inertia}, {b.mass, a.com, b.inertia}}},
            {"inertias", {{a.mass, a.com, b.inertia}, {b.mass, b.com, a.inertia}}}};
        for (const auto& [what, exchanged] : exchanges) {
          if (!IsRight(i, exchanged.first) || !IsRight(j, exchanged.second)) continue;
          Add("links " + bodies_[i].link + " and " + bodies_[j].link + ": their " + what + " look exchanged",
              {i, j});
          break;
        }
      }
    }
  }

  /// The right body is made of several, one of which is missing.
  void FindLostParts() {
    for (const size_t i : ListOpen()) {
      const std::vector<DescribedPart>& parts = bodies_[i].parts;
      for (size_t left_out = 0; parts.size() > 1 && left_out < parts.size(); ++left_out) {
        std::vector<MassProperties> others;
        for (size_t k = 0; k < parts.size(); ++k) {
          if (k != left_out) others.push_back(parts[k].body);
        }
        if (!IsSame(bodies_[i].given, Combine(others))) continue;
        Add("link " + bodies_[i].link + ": the mass of " + Quote(parts[left_out].name) +
                ", which is welded to it, looks lost",
            {i});
        break;
      }
    }
  }

  void FindPartFaults() {
    for (const size_t i : ListOpen()) {
      const std::optional<std::string> text = DescribePartFault(bodies_[i], length_, tolerance_);
      if (text) Add("link " + bodies_[i].link + ": " + *text, {i});
    }
  }

  const std::vector<ComparedBody>& bodies_;
  double length_;
  double tolerance_;
  std::vector<bool> is_open_;  // differs, and nothing explains it yet
  double squares_ = 0.0;
  size_t count_ = 0;  // links with mass
  std::vector<Hypothesis> found_;
};

}  // namespace

bool IsExplainedAlone(const ComparedBody& body, double length, double tolerance) {
  const std::vector<BodyFault> faults = ListBodyFaults();
  return std::any_of(faults.begin(), faults.end(), [&](const BodyFault& fault) {
    const std::optional<MassProperties> undone = fault.undo(body);
    return undone && CompareBodies(*undone, body.right, length).largest() <= tolerance;
  });
}

std::vector<Hypothesis> FindBodyHypotheses(const std::vector<ComparedBody>& bodies, double length,
                                           double tolerance) {
  return BodySearch(bodies, length, tolerance).Run();
}

}  // namespace dexcheck
