#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "harness/report/run_figures.h"

namespace dexcheck {
namespace {

constexpr double kLeastSpan = 0.02;  // m, rad

/// Where the sine of beta is less than this, a rotation by 1e-4 rad can turn alpha and gamma by 1e-2 rad and
/// more.
constexpr double kSingularSine = 0.01;

/// What a reader of ZYZ angles has to know; nothing while beta keeps away from 0 and pi.
/// @param beta the second ZYZ angle at each row, rad.
std::string NoteOnAngles(const VectorXd& beta) {
  if (beta.size() == 0 || beta.array().sin().abs().minCoeff() >= kSingularSine) return "";
  return "Where β is near 0 or π, only the sum or the difference of α and γ is an orientation: either may "
         "jump while "
         "the object is at rest.";
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
    AddErrors();
    AddFrictionUse();
    AddContactDrift();
    return std::move(figures_);
  }

 private:
  /// The finger that a fingertip or finger joint belongs to: what stands before the underscore.
  static std::string NameFinger(const std::string& part) { return part.substr(0, part.find('_')); }

  void Add(Figure figure) {
    if (!figure.curves.empty()) figures_.push_back(std::move(figure));
  }

  void AddObject() {
    const SignalInfo* const actual = run_.Find("object/X_o");
    const SignalInfo* const desired = run_.Find("object/X_d");
    if (actual == nullptr || desired == nullptr || actual->width != 6 || desired->width != 6) return;
    const RowMatrixXd X_o = run_.log().ReadSignal("object/X_o");
    const RowMatrixXd X_d = run_.log().ReadSignal("object/X_d");
    Figure a{"fig12a", "12 (a)", "Motion of the object along x", "x (m)", "", false, kLeastSpan, {}, {},
             "",       true};
    a.curves = {{"x actual", X_o.col(0), 0, 0, false}, {"x desired", X_d.col(0), 0, 0, false, true, true}};
    Add(a);
    Figure b{"fig12b",
             "12 (b)",
             "Motion of the object along y and z, and its orientation",
             "position (m)",
             "ZYZ angle (rad)",
             false,
             kLeastSpan,
             {},
             {},
             "",
             true};
    const char* const names[] = {"x", "y", "z", "α", "β", "γ"};
    for (int k = 1; k < 6; ++k) {
      b.curves.push_back({std::string(names[k]) + (k < 3 ? " (m)" : " (rad)"), X_o.col(k), k - 1, 0, k >= 3});
    }
    for (int k = 1; k < 6; ++k) {
      b.curves.push_back({std::string(names[k]) + " desired", X_d.col(k), k - 1, 0, k >= 3, true, true});
    }
    b.note = NoteOnAngles(X_o.col(4));
    Add(b);
  }

  /// Of a robot that holds nothing: where its joints are, should be, and how far they are from there.
  void AddJoints() {
    const SignalInfo* const desired = run_.Find("joints/q_d");
    const SignalInfo* const error = run_.Find("joints/error");
    const SignalInfo* const actual = run_.Find("q");
    if (desired == nullptr || error == nullptr || actual == nullptr) return;
    if (desired->width > actual->width || error->width != desired->width) return;
    const RowMatrixXd q = run_.log().ReadSignal("q").rightCols(desired->width);  // without the base's
    const RowMatrixXd q_d = run_.log().ReadSignal("joints/q_d");
    const RowMatrixXd e = run_.log().ReadSignal("joints/error");
    Figure motion{"joints", "",  "Motion of the joints", "position (rad, m)", "", false, kLeastSpan, {}, {},
                  "",       true};
    Figure errors{
        "joint_errors", "", "Errors of the joints", "error (rad, m)", "", true, 0.0, {}, {}, "", true};
    for (int k = 0; k < desired->width; ++k) {
      motion.curves.push_back({RunData::NameColumn(*desired, k), q.col(k), k, 0, false});
      errors.curves.push_back({RunData::NameColumn(*desired, k), e.col(k).cwiseAbs(), k, 0, false});
    }
    for (int k = 0; k < desired->width; ++k) {
      motion.curves.push_back(
          {RunData::NameColumn(*desired, k) + " desired", q_d.col(k), k, 0, false, true, true});
    }
    Add(motion);
    Add(errors);
  }

  void AddPlatform() {
    const SignalInfo* const q = run_.Find("q");
    if (q == nullptr || q->columns.size() < 3 || q->columns[2] != "phi") return;
    const RowMatrixXd values = run_.log().ReadSignal("q");
    Figure c{"fig12c",
             "12 (c)",
             "Motion of the mobile platform",
             "position (m)",
             "heading (rad)",
             false,
             kLeastSpan,
             {},
             {},
             "",
             true};
    c.curves = {{"x_c (m)", values.col(0), 0, 0, false},
                {"y_c (m)", values.col(1), 1, 0, false},
                {"φ (rad)", values.col(2), 2, 1, true}};
    Add(c);
  }

  /// Torques of the joints whose names satisfy `belongs`; fingers by color, their joints by dashes.
  void AddTorqueFigure(Figure figure, const std::function<bool(const std::string&)>& belongs) {
    const SignalInfo* const tau = run_.Find("tau");
    if (tau == nullptr) return;
    const RowMatrixXd values = run_.log().ReadSignal("tau");
    figure.label = "torque (N m)";
    figure.least_span = 1e-3;
    int color = 0;
    int dash = 0;
    std::string finger;
    for (int k = 0; k < tau->width; ++k) {
      const std::string joint = RunData::NameColumn(*tau, k);
      if (!belongs(joint)) continue;
      if (IsFinger(joint)) {
        dash = NameFinger(joint) == finger ? dash + 1 : 0;
        color = NameFinger(joint) == finger || finger.empty() ? color : color + 1;
        finger = NameFinger(joint);
      }
      figure.curves.push_back({joint, values.col(k), color, dash, false});
      if (!IsFinger(joint) && ++color % 8 == 0) ++dash;
    }
    Add(std::move(figure));
  }

  /// By name, as the paper's robot has them: "rf1_2".
  static bool IsPapersFinger(const std::string& joint) {
    return joint.size() > 3 && (joint[0] == 'r' || joint[0] == 'l') && joint[1] == 'f' &&
           joint.find('_') != std::string::npos;
  }

  /// Whether it is one of the fingers that hold the object. They are told apart by what stands before the
  /// underscore; another robot's, if that is not the same of all fingertips.
  [[nodiscard]] bool Grasps(const std::string& joint) const {
    const SignalInfo* const contacts = run_.Find("contact/overlap");
    if (contacts == nullptr || contacts->columns.empty()) return false;
    const std::vector<std::string>& tips = contacts->columns;
    const auto is_of = [](const std::string& finger) {
      return [finger](const std::string& part) { return NameFinger(part) == finger; };
    };
    const bool are_alike = std::all_of(tips.begin(), tips.end(), is_of(NameFinger(tips.front())));
    if (are_alike && !IsPapersFinger(joint)) return false;
    return std::any_of(tips.begin(), tips.end(), is_of(NameFinger(joint)));
  }

  [[nodiscard]] bool IsFinger(const std::string& joint) const {
    return IsPapersFinger(joint) || Grasps(joint);
  }

  /// Whether the torques are those of the paper's robot, whose arms and trunk have figures of their own.
  [[nodiscard]] bool IsPapersRobot() const {
    const SignalInfo* const tau = run_.Find("tau");
    return tau != nullptr && std::any_of(tau->columns.begin(), tau->columns.end(),
                                         [](const std::string& name) { return name.starts_with("waist"); });
  }

  void AddTorques() {
    const bool is_papers = IsPapersRobot();
    const auto grasps = [&](const std::string& joint) { return Grasps(joint); };
    const auto idle = [&](const std::string& joint) { return IsFinger(joint) && !Grasps(joint); };
    const auto left = [&](const std::string& joint) { return is_papers && joint.starts_with("l_"); };
    const auto trunk = [&](const std::string& joint) {
      return is_papers &&
             (joint.starts_with("wheel") || joint.starts_with("waist") || joint.starts_with("r_"));
    };
    Figure figure;
    figure.printed = true;
    const auto add = [&](const char* name, const char* panel, const char* title, const auto& belongs) {
      figure.name = name;
      figure.panel = panel;
      figure.title = title;
      AddTorqueFigure(figure, belongs);
    };
    add("fig12d", "12 (d)", "Torques of the grasping fingers' joints", grasps);
    add("fig12e", "12 (e)", "Torques of the left arm's joints", left);
    add("fig12f", "12 (f)", "Torques of wheels, waist and right arm", trunk);
    figure.printed = false;
    add("idle_finger_torques", "", "Torques of the other fingers' joints", idle);
    const bool are_all = run_.Find("contact/overlap") == nullptr && !is_papers;
    figure.printed = are_all;
    add("other_torques", "", are_all ? "Torques of the joints" : "Torques of other joints",
        [&](const std::string& joint) {
          return !grasps(joint) && !idle(joint) && !left(joint) && !trunk(joint);
        });
  }

  /// How far contacts that the law follows by (40) are from where they are.
  void AddContactDrift() {
    Figure figure{"contact_drift",
                  "",
                  "Contacts followed by (40) against where they are",
                  "points on object and fingertip (m)",
                  "psi (rad)",
                  true,
                  0.0,
                  {},
                  {},
                  "",
                  false};
    int dash = 0;
    for (const auto& [name, what] : {std::pair{"contact/drift_object", " on the object"},
                                     std::pair{"contact/drift_fingertip", " on the fingertip"},
                                     std::pair{"contact/drift_psi", " psi"}}) {
      const SignalInfo* const drift = run_.Find(name);
      if (drift == nullptr) continue;
      const RowMatrixXd values = run_.log().ReadSignal(name);
      for (int k = 0; k < drift->width; ++k)
        figure.curves.push_back(
            {RunData::NameColumn(*drift, k) + what, values.col(k), k, dash, /*right_axis=*/dash == 2});
      ++dash;
    }
    Add(std::move(figure));
  }

  void AddForces() {
    const SignalInfo* const f_c = run_.Find("contact/f_c");
    if (f_c == nullptr || f_c->width % 3 != 0) return;
    const auto mu = f_c->attributes.find("mu");
    const RowMatrixXd forces = run_.log().ReadSignal("contact/f_c");
    const SignalInfo* const commanded = run_.Find("law/f_c");
    RowMatrixXd optimal;
    if (commanded != nullptr && commanded->width == f_c->width) optimal = run_.log().ReadSignal("law/f_c");
    for (int i = 0; i < f_c->width / 3; ++i) {
      const std::string column = RunData::NameColumn(*f_c, 3 * i);
      const std::string tip = column.substr(0, column.find('.'));
      const std::string letter(1, static_cast<char>('a' + i));
      Figure figure{"fig13" + letter,
                    "13 (" + letter + ")",
                    "Contact forces of finger " + std::to_string(i + 1) + " (" + tip + ")",
                    "force (N)",
                    "",
                    false,
                    0.1,
                    {},
                    {},
                    "",
                    true};
      const VectorXd normal = forces.col(3 * i + 2);
      const bool has_optimal = optimal.size() > 0 && optimal.allFinite();
      const char* const what = has_optimal ? ", measured" : "";
      figure.curves = {
          {std::string("normal") + what, normal, 0, 0, false},
          {std::string("tangential") + what, forces.middleCols<2>(3 * i).rowwise().norm(), 1, 0, false}};
      if (has_optimal) {
        figure.curves.push_back({"normal, optimal (49)", optimal.col(3 * i + 2), 0, 0, false, true, true});
        figure.curves.push_back({"tangential, optimal (49)", optimal.middleCols<2>(3 * i).rowwise().norm(), 1,
                                 0, false, true, true});
      }
      if (mu != f_c->attributes.end()) {
        figure.curves.push_back({"friction cone: μ × normal", mu->second * normal, 2, 2, false});
      }
      Add(figure);
    }
  }

  void AddErrors() {
    Figure figure{"tracking_error",
                  "",
                  "Error of the object against its desired motion",
                  "position error (m)",
                  "",
                  true,
                  0.0,
                  {},
                  {},
                  "",
                  true};
    if (run_.Find("object/position_error") == nullptr || run_.Find("object/orientation_error") == nullptr)
      return;
    figure.label = "error (m, rad)";
    figure.curves = {
        {"position (m)", run_.log().ReadSignal("object/position_error").col(0), 0, 0, false},
        {"orientation (rad)", run_.log().ReadSignal("object/orientation_error").col(0), 1, 0, false}};
    Add(figure);
  }

  void AddFrictionUse() {
    Figure figure{"friction_use",
                  "",
                  "Tangential force as a fraction of what friction can hold",
                  "|f_t| / (μ f_n)",
                  "",
                  false,
                  0.1,
                  {},
                  {},
                  "",
                  false};
    for (const char* name : {"contact/cone_use", "wheel/cone_use"}) {
      const SignalInfo* const signal = run_.Find(name);
      if (signal == nullptr) continue;
      const RowMatrixXd values = run_.log().ReadSignal(name);
      for (int k = 0; k < signal->width; ++k) {
        figure.curves.push_back({RunData::NameColumn(*signal, k), values.col(k),
                                 static_cast<int>(figure.curves.size()), 0, false});
      }
    }
    figure.bound = 1.0;
    Add(figure);
  }

  const RunData& run_;
  std::vector<Figure> figures_;
};

}  // namespace

std::vector<Figure> MakeMotionFigures(const RunData& run) { return MotionFigures(run).Make(); }

}  // namespace dexcheck
