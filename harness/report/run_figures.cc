#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "harness/report/page.h"

namespace dexcheck {
namespace {

constexpr double kLeastSpan = 0.02;  // m, rad

/// Least sine of beta of good angles: where it is less, a rotation by 1e-4 rad can turn alpha and gamma by
/// 1e-2 rad and more.
constexpr double kSingularSine = 0.01;

/// A note for readers of ZYZ angles; nothing while beta keeps away from 0 and pi.
/// @param beta the second ZYZ angle at each row, rad.
std::string NoteOnAngles(const VectorXd& beta) {
  if (beta.size() == 0 || beta.array().sin().abs().minCoeff() >= kSingularSine) return "";
  return "Where β is near 0 or π, only the sum or the difference of α and γ is an orientation: either may "
         "jump while the object is at rest.";
}

/// The finger that a fingertip or finger joint belongs to: what stands before the underscore.
std::string NameFinger(const std::string& part) { return part.substr(0, part.find('_')); }

/// By name, as the paper's robot has them: "rf1_2".
bool IsPapersFinger(const std::string& joint) {
  return joint.size() > 3 && (joint[0] == 'r' || joint[0] == 'l') && joint[1] == 'f' &&
         joint.find('_') != std::string::npos;
}

class MotionFigures {
 public:
  explicit MotionFigures(const RunData& run) : run_(run) {}

  std::vector<Figure> Make() {
    AddObject();
    AddJoints();
    AddPlatform();
    AddTorques();
    AddForces();
    AddMeasures();
    if (!run_.is_papers()) {
      for (Figure& figure : figures_) figure.panel.clear();
    }
    std::stable_partition(figures_.begin(), figures_.end(), [](const Figure& one) { return one.answers; });
    return std::move(figures_);
  }

 private:
  [[nodiscard]] RowMatrixXd Read(const char* signal) const { return run_.log().ReadSignal(signal); }
  [[nodiscard]] bool Has(const char* signal) const { return run_.Find(signal) != nullptr; }
  [[nodiscard]] int WidthOf(const char* signal) const { return Has(signal) ? run_.Find(signal)->width : 0; }
  [[nodiscard]] std::string NameColumn(const char* signal, int column) const {
    return RunData::NameColumn(*run_.Find(signal), column);
  }

  void Add(Figure figure) {
    if (!figure.curves.empty()) figures_.push_back(std::move(figure));
  }

  void AddObject() {
    if (WidthOf("object/X_o") != 6 || WidthOf("object/X_d") != 6) return;
    const RowMatrixXd X_o = Read("object/X_o");
    const RowMatrixXd X_d = Read("object/X_d");
    Add({.name = "fig12a",
         .panel = "12 (a)",
         .title = "Motion of the object along x",
         .label = "x (m)",
         .least_span = kLeastSpan,
         .curves = {{.label = "x actual", .values = X_o.col(0)},
                    {.label = "x desired", .values = X_d.col(0), .wide = true}},
         .printed = true});
    Figure b{.name = "fig12b",
             .panel = "12 (b)",
             .title = "Motion of the object along y and z, and its orientation",
             .label = "position (m)",
             .right_label = "ZYZ angle (rad)",
             .least_span = kLeastSpan,
             .note = NoteOnAngles(X_o.col(4)),
             .printed = true};
    const char* const names[] = {"x", "y", "z", "α", "β", "γ"};
    for (const bool desired : {false, true}) {
      for (int k = 1; k < 6; ++k) {
        const std::string what = desired ? " desired" : k < 3 ? " (m)" : " (rad)";
        b.curves.push_back({.label = names[k] + what,
                            .values = (desired ? X_d : X_o).col(k),
                            .color = k - 1,
                            .right_axis = k >= 3,
                            .wide = desired});
      }
    }
    Add(b);
  }

  /// Adds for a robot that holds nothing where its joints are, should be, and how far they are from there.
  void AddJoints() {
    const int count = WidthOf("joints/q_d");
    if (count == 0 || count > WidthOf("q") || WidthOf("joints/error") != count) return;
    const RowMatrixXd q = Read("q").rightCols(count);  // without the base's
    const RowMatrixXd q_d = Read("joints/q_d");
    const RowMatrixXd e = Read("joints/error");
    Figure motion{.name = "joints",
                  .title = "Motion of the joints",
                  .label = "position (rad, m)",
                  .least_span = kLeastSpan,
                  .printed = true};
    Figure errors{.name = "joint_errors",
                  .title = "Errors of the joints",
                  .label = "error (rad, m)",
                  .log = true,
                  .answers = true,
                  .printed = true};
    for (int k = 0; k < count; ++k) {
      const std::string joint = NameColumn("joints/q_d", k);
      motion.curves.push_back({.label = joint, .values = q.col(k), .color = k});
      errors.curves.push_back({.label = joint, .values = e.col(k).cwiseAbs(), .color = k});
    }
    for (int k = 0; k < count; ++k) {
      motion.curves.push_back({.label = NameColumn("joints/q_d", k) + " desired",
                               .values = q_d.col(k),
                               .color = k,
                               .wide = true});
    }
    Add(motion);
    Add(errors);
  }

  void AddPlatform() {
    if (!Has("q") || run_.Find("q")->columns.size() < 3 || run_.Find("q")->columns[2] != "phi") return;
    AddOf({.name = "fig12c",
           .panel = "12 (c)",
           .title = "Motion of the mobile platform",
           .label = "position (m)",
           .right_label = "heading (rad)",
           .least_span = kLeastSpan,
           .printed = true},
          {{"q", 0, "x_c (m)"}, {"q", 1, "y_c (m)"}, {"q", 2, "φ (rad)", 1, true}});
  }

  /// A joint grasps where it is one of the fingers that hold the object. They are distinguished by what
  /// stands before the underscore; another robot's, if that is not the same of all fingertips.
  [[nodiscard]] bool Grasps(const std::string& joint) const {
    const SignalInfo* const contacts = run_.Find("contact/overlap");
    if (contacts == nullptr || contacts->columns.empty()) return false;
    const std::vector<std::string>& tips = contacts->columns;
    const auto is_of = [](const std::string& finger) {
      return [finger](const std::string& part) { return NameFinger(part) == finger; };
    };
    const bool are_alike = std::ranges::all_of(tips, is_of(NameFinger(tips.front())));
    if (are_alike && !IsPapersFinger(joint)) return false;
    return std::ranges::any_of(tips, is_of(NameFinger(joint)));
  }

  [[nodiscard]] bool IsFinger(const std::string& joint) const {
    return IsPapersFinger(joint) || Grasps(joint);
  }

  /// Torques of the joints whose names satisfy `belongs`; fingers by color, their joints by dashes.
  void AddTorqueFigure(Figure figure, const std::function<bool(const std::string&)>& belongs) {
    const RowMatrixXd values = Read("tau");
    figure.label = "torque (N m)";
    figure.least_span = 1e-3;
    int color = 0;
    int dash = 0;
    std::string finger;
    for (int k = 0; k < WidthOf("tau"); ++k) {
      const std::string joint = NameColumn("tau", k);
      if (!belongs(joint) || values.col(k).isZero(0.0)) continue;  // nothing drives a floating base
      if (IsFinger(joint)) {
        dash = NameFinger(joint) == finger ? dash + 1 : 0;
        color = NameFinger(joint) == finger || finger.empty() ? color : color + 1;
        finger = NameFinger(joint);
      }
      figure.curves.push_back({.label = joint, .values = values.col(k), .color = color, .dash = dash});
      if (!IsFinger(joint) && ++color % 8 == 0) ++dash;
    }
    Add(std::move(figure));
  }

  void AddTorques() {
    if (!Has("tau")) return;
    // Arms and trunk of the paper's robot have figures of their own.
    const auto has = [&](const char* word) {
      return std::ranges::any_of(run_.Find("tau")->columns,
                                 [&](const std::string& name) { return name.starts_with(word); });
    };
    const bool is_papers = has("waist") && has("wheel");
    const auto grasps = [&](const std::string& joint) { return Grasps(joint); };
    const auto idle = [&](const std::string& joint) { return IsFinger(joint) && !Grasps(joint); };
    const auto left = [&](const std::string& joint) { return is_papers && joint.starts_with("l_"); };
    const auto trunk = [&](const std::string& joint) {
      return is_papers &&
             (joint.starts_with("wheel") || joint.starts_with("waist") || joint.starts_with("r_"));
    };
    const auto other = [&](const std::string& joint) {
      return !grasps(joint) && !idle(joint) && !left(joint) && !trunk(joint);
    };
    const bool are_all = !Has("contact/overlap") && !is_papers;
    AddTorqueFigure({.name = "fig12d",
                     .panel = "12 (d)",
                     .title = "Torques of the grasping fingers' joints",
                     .printed = true},
                    grasps);
    AddTorqueFigure(
        {.name = "fig12e", .panel = "12 (e)", .title = "Torques of the left arm's joints", .printed = true},
        left);
    AddTorqueFigure({.name = "fig12f",
                     .panel = "12 (f)",
                     .title = "Torques of wheels, waist and right arm",
                     .printed = true},
                    trunk);
    AddTorqueFigure({.name = "idle_finger_torques", .title = "Torques of the other fingers' joints"}, idle);
    AddTorqueFigure({.name = "other_torques",
                     .title = are_all ? "Torques of the joints" : "Torques of other joints",
                     .printed = are_all},
                    other);
  }

  void AddForces() {
    const int width = WidthOf("contact/f_c");
    if (width % 3 != 0) return;
    const RowMatrixXd forces = width > 0 ? Read("contact/f_c") : RowMatrixXd();
    const RowMatrixXd optimal = WidthOf("law/f_c") == width && width > 0 ? Read("law/f_c") : RowMatrixXd();
    const bool has_optimal = optimal.size() > 0 && optimal.allFinite();
    for (int i = 0; i < width / 3; ++i) {
      const std::string column = NameColumn("contact/f_c", 3 * i);
      const std::string tip = column.substr(0, column.find('.'));
      const std::string letter(1, static_cast<char>('a' + i));
      Figure figure{.name = "fig13" + letter,
                    .panel = "13 (" + letter + ")",
                    .title = "Contact forces of finger " + std::to_string(i + 1) + " (" + tip + ")",
                    .label = "force (N)",
                    .least_span = 0.1,
                    .printed = true};
      const auto add = [&](const RowMatrixXd& all, const char* what, bool wide) {
        figure.curves.push_back(
            {.label = std::string("normal") + what, .values = all.col(3 * i + 2), .wide = wide});
        figure.curves.push_back({.label = std::string("tangential") + what,
                                 .values = all.middleCols<2>(3 * i).rowwise().norm(),
                                 .color = 1,
                                 .wide = wide});
      };
      add(forces, has_optimal ? ", measured" : "", false);
      if (has_optimal) add(optimal, ", optimal (49)", true);
      const auto& attributes = run_.Find("contact/f_c")->attributes;
      if (const auto mu = attributes.find("mu"); mu != attributes.end()) {
        figure.curves.push_back({.label = "friction cone: μ × normal",
                                 .values = mu->second * forces.col(3 * i + 2),
                                 .color = 2,
                                 .dash = 2});
      }
      Add(figure);
    }
  }

  /// The source of curves: a column of a signal, or all of them (-1).
  struct Columns {
    const char* signal;
    int column;
    std::string label;  ///< Of all columns what follows their names.
    int dash = 0;
    bool right_axis = false;
  };

  /// Adds a figure of those that were recorded.
  void AddOf(Figure figure, const std::vector<Columns>& all) {
    for (const Columns& one : all) {
      if (!Has(one.signal)) continue;
      const bool is_one = one.column >= 0;
      const RowMatrixXd values = Read(one.signal);
      const int first = static_cast<int>(figure.curves.size());
      for (int k = std::max(one.column, 0); k < (is_one ? one.column + 1 : WidthOf(one.signal)); ++k)
        figure.curves.push_back({.label = is_one ? one.label : NameColumn(one.signal, k) + one.label,
                                 .values = values.col(k),
                                 .color = one.dash > 0 ? k : first + (is_one ? 0 : k),
                                 .dash = one.dash,
                                 .right_axis = one.right_axis});
    }
    Add(std::move(figure));
  }

  void AddMeasures() {
    AddOf(
        {.name = "tracking_error",
         .title = "Error of the object against its desired motion",
         .label = "error (m, rad)",
         .log = true,
         .answers = true,
         .printed = true},
        {{"object/position_error", 0, "position (m)"}, {"object/orientation_error", 0, "orientation (rad)"}});
    AddOf({.name = "torque_use",
           .title = "Largest torque as a fraction of its motor's limit",
           .label = "|τ| / limit",
           .least_span = 0.1,
           .bound = 1.0,
           .answers = true},
          {{"check/actuator_effort", 0, "largest of all motors"}});
    AddOf({.name = "friction_use",
           .title = "Tangential force as a fraction of what friction can hold",
           .label = "|f_t| / (μ f_n)",
           .least_span = 0.1,
           .bound = 1.0,
           .answers = true},
          {{"contact/cone_use", -1, ""}, {"wheel/cone_use", -1, ""}});
    AddOf({.name = "contact_drift",  // of contacts that the law follows by (40)
           .title = "Contacts followed by (40) against where they are",
           .label = "points on object and fingertip (m)",
           .right_label = "psi (rad)",
           .log = true},
          {{"contact/drift_object", -1, " on the object"},
           {"contact/drift_fingertip", -1, " on the fingertip", 1},
           {"contact/drift_psi", -1, " psi", 2, true}});
  }

  const RunData& run_;
  std::vector<Figure> figures_;
};

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

std::vector<Figure> MakeMotionFigures(const RunData& run) { return MotionFigures(run).Make(); }

std::vector<Figure> MakeResidualFigures(const RunData& run) {
  std::vector<Figure> figures;
  for (const CheckCategory kind : kCheckCategories) {
    Figure figure = MakeFigure(run, kind);
    if (!figure.curves.empty()) figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace dexcheck
