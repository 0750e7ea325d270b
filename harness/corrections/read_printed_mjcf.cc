#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "harness/corrections/read_printed.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using MjcfElement = tinyxml2::XMLElement;
class PrintedMjcfReader {
 public:
  PrintedMjcfReader(const MjcfFile& mjcf, const mjModel& engine)
      : root_(*mjcf.root()), engine_(engine), classes_(&root_), changes_(ListCompiledChanges(mjcf, engine)) {
    for (const MjcfElement* compiler : ListChildren(&root_, "compiler")) {
      if (compiler->Attribute("angle") != nullptr)
        unit_ = ReadAttribute(*compiler, "angle") == "radian" ? 1.0 : kDegree;
      const std::string sequence = ReadAttribute(*compiler, "eulerseq");
      if (sequence.size() == 3) sequence_ = {sequence[0], sequence[1], sequence[2]};
    }
  }

  PrintedRobot Read() {
    robot_.format = RobotFormat::kMjcf;
    robot_.gravity = MapVector(engine_.opt.gravity);
    PrintedLink world;
    world.name = "world";
    robot_.Add(std::move(world));
    for (const MjcfElement* part : ListChildren(&root_, "worldbody")) {
      for (const MjcfElement* body : ListChildren(part, "body"))
        ReadBody(*body, 0, ReadAttribute(*part, "childclass"));
    }
    robot_.floats = engine_.njnt > 0 && engine_.jnt_type[0] == mjJNT_FREE;
    AddFrames();
    ReadEqualities();
    ReadTendons();
    ReadMotors();
    return std::move(robot_);
  }

 private:
  static constexpr double kDegree = kPi / 180.0;

  /// The engine's numbers have no digits: those of a text of seven.
  static constexpr double kEngineDigits = 1e-7;

  /// An attribute of an element, its own or its class's; empty without one.
  [[nodiscard]] std::string FindText(const MjcfElement& element, const std::string& around,
                                     const char* name) const {
    const char* const text = classes_.Find(element, around, name);
    return text == nullptr ? "" : text;
  }

  [[nodiscard]] PrintedOrigin ReadOrigin(const MjcfElement& element) const {
    PrintedOrigin origin;
    origin.form = RotationForm::kQuaternion;
    origin.r[0] = 1.0;
    std::tie(origin.t, origin.half_t) = ReadPrintedVector<3>(ReadAttribute(element, "pos"));
    const auto turn = [&](const Matrix3d& R, double half) {
      origin.r = ToQuaternion(R);
      origin.half_r.setConstant(half);
    };
    if (element.Attribute("quat") != nullptr) {
      std::tie(origin.r, origin.half_r) = ReadPrintedVector<4>(ReadAttribute(element, "quat"));
    } else if (element.Attribute("euler") != nullptr) {
      const auto [angles, halves] = ReadPrintedVector<3>(ReadAttribute(element, "euler"));
      origin.form = RotationForm::kEuler;
      origin.sequence = sequence_;
      origin.r.setZero();
      origin.r.head<3>() = angles * unit_;
      origin.half_r.head<3>() = halves * unit_;
    } else if (element.Attribute("axisangle") != nullptr) {
      const auto [v, halves] = ReadPrintedVector<4>(ReadAttribute(element, "axisangle"));
      turn(Eigen::AngleAxisd(v[3] * unit_, v.head<3>().normalized()).toRotationMatrix(),
           std::max(halves.head<3>().maxCoeff(), halves[3] * unit_));
    } else if (element.Attribute("xyaxes") != nullptr) {
      const auto [v, halves] = ReadPrintedVector<6>(ReadAttribute(element, "xyaxes"));
      Matrix3d R;
      R.col(0) = v.head<3>().normalized();
      R.col(1) = (v.tail<3>() - R.col(0) * R.col(0).dot(v.tail<3>())).normalized();
      R.col(2) = R.col(0).cross(R.col(1));
      turn(R, halves.maxCoeff());
    } else if (element.Attribute("zaxis") != nullptr) {
      const auto [v, halves] = ReadPrintedVector<3>(ReadAttribute(element, "zaxis"));
      turn(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), v).toRotationMatrix(), halves.maxCoeff());
    }
    return origin;
  }

  /// Gives a pose that was read otherwise than the engine compiled it the engine's numbers.
  static void TakeEngine(const mjtNum* pos, const mjtNum* quat, PrintedOrigin* origin) {
    constexpr double kSame = 1e-6;
    const Matrix3d R = TurnQuaternion(Vector4d(quat[0], quat[1], quat[2], quat[3]));
    const Vector3d t = MapVector(pos);
    if ((origin->t - t).norm() <= kSame && CalcAngle(origin->CalcRotation().transpose() * R) <= kSame) return;
    origin->t = t;
    origin->half_t.setConstant(kEngineDigits);
    origin->form = RotationForm::kQuaternion;
    origin->r = ToQuaternion(R);
    origin->half_r.setConstant(kEngineDigits);
  }

  [[nodiscard]] PrintedInertial ReadStated(const MjcfElement& element) const {
    PrintedInertial inertial;
    inertial.origin = ReadOrigin(element);
    inertial.mass = ReadPrintedScalar(ReadAttribute(element, "mass")).value_or(PrintedScalar{});
    if (element.Attribute("fullinertia") != nullptr) {
      std::tie(inertial.I, inertial.half_I) = ReadPrintedVector<6>(ReadAttribute(element, "fullinertia"));
    } else {
      const auto [moments, halves] = ReadPrintedVector<3>(ReadAttribute(element, "diaginertia"));
      inertial.I.head<3>() = moments;
      inertial.half_I.head<3>() = halves;
    }
    return inertial;
  }

  /// The engine's body: its shapes' mass, or what a setting of the compiler made of the text.
  [[nodiscard]] PrintedInertial ReadMade(int id) const {
    const MassProperties made = ReadEngineBody(engine_, id);
    PrintedInertial inertial;
    inertial.origin.form = RotationForm::kQuaternion;
    inertial.origin.r[0] = 1.0;
    inertial.mass = {made.mass, kEngineDigits * made.mass};
    inertial.origin.t = made.com;
    inertial.origin.half_t.setConstant(kEngineDigits);
    inertial.I = ToEntries(made.inertia);
    inertial.half_I.setConstant(kEngineDigits * made.inertia.trace());
    return inertial;
  }

  void ReadInertial(const MjcfElement& body, int id, PrintedLink* link) const {
    constexpr double kSame = 1e-6;
    const double mass = engine_.body_mass[id];
    const MjcfElement* const element = body.FirstChildElement("inertial");
    if (element != nullptr) link->inertial = ReadStated(*element);
    const bool is_stated = element != nullptr && std::abs(link->inertial->mass.value - mass) <= kSame * mass;
    CompiledInertial compiled;
    for (const CompiledChange& change : changes_) {
      if (change.body != NameOf(engine_, mjOBJ_BODY, id) || element == nullptr) continue;
      const bool is_mass = change.stated.size() == 1;
      const auto list = [](const std::vector<double>& numbers) {
        return fmt::format("{:.6g}", fmt::join(numbers, " "));
      };
      compiled.setting = change.setting;
      compiled.description +=
          fmt::format("{}{}: {} {} in the text, {} in the engine", compiled.description.empty() ? "" : "; ",
                      change.setting, is_mass ? "mass" : "moments", list(change.stated), list(change.made));
      compiled.stated = *link->inertial;
    }
    if (!compiled.setting.empty()) link->compiled = compiled;
    if (is_stated && compiled.setting.empty()) return;
    link->inertial.reset();
    if (mass > 0.0) link->inertial = ReadMade(id);
    link->is_from_shapes = element == nullptr && mass > 0.0;
  }

  [[nodiscard]] PrintedJoint ReadJoint(const MjcfElement& element, const std::string& around, int id) const {
    PrintedJoint joint;
    const auto find = [&](const char* name) { return FindText(element, around, name); };
    joint.name = NameOf(engine_, mjOBJ_JOINT, id);
    constexpr JointKind kKinds[] = {JointKind::kFree, JointKind::kBall, JointKind::kSlide, JointKind::kHinge};
    joint.kind = kKinds[engine_.jnt_type[id]];
    if (joint.kind == JointKind::kFree) return joint;
    const std::string axis = find("axis");
    std::tie(joint.axis, joint.half_axis) = ReadPrintedVector<3>(axis.empty() ? "0 0 1" : axis);
    joint.anchor = MapVector(engine_.jnt_pos + 3 * id);
    if (joint.kind != JointKind::kBall) joint.ref = engine_.qpos0[engine_.jnt_qposadr[id]];
    const double unit = joint.kind == JointKind::kSlide ? 1.0 : unit_;
    if (engine_.jnt_limited[id] != 0 && joint.kind != JointKind::kBall) {
      const auto [range, halves] = ReadPrintedVector<3>(find("range"));
      joint.range = {PrintedScalar{range[0] * unit, halves[0] * unit},
                     PrintedScalar{range[1] * unit, halves[1] * unit}};
    }
    const auto take = [&](JointScalar scalar, const char* name, double factor) {
      const std::optional<PrintedScalar> number = ReadPrintedScalar(find(name));
      joint.scalars[static_cast<size_t>(scalar)] =
          number ? PrintedScalar{number->value * factor, number->half * factor} : PrintedScalar{};
    };
    take(JointScalar::kDamping, "damping", 1.0);
    take(JointScalar::kFriction, "frictionloss", 1.0);
    take(JointScalar::kArmature, "armature", 1.0);
    take(JointScalar::kStiffness, "stiffness", 1.0);
    if (joint.scalars[static_cast<size_t>(JointScalar::kStiffness)]->value != 0.0)
      take(JointScalar::kSpringAngle, "springref", unit);
    return joint;
  }

  /// Undoes a joint's reference: at zero it stands elsewhere than the file has its body.
  void UndoReference(int id, PrintedLink* link) const {
    const double reference = engine_.qpos0[engine_.jnt_qposadr[id]];
    if (reference == 0.0 || (link->joint.kind != JointKind::kHinge && link->joint.kind != JointKind::kSlide))
      return;
    const Vector3d axis = link->joint.axis.normalized();
    Pose X = Pose::Identity();
    if (link->joint.kind == JointKind::kHinge) {
      X = Eigen::Translation3d(link->joint.anchor) * Eigen::AngleAxisd(-reference, axis) *
          Eigen::Translation3d(-link->joint.anchor);
    } else {
      X.translation() = -reference * axis;
    }
    X = link->origin.CalcPose() * X;
    const double half = link->origin.half_r.maxCoeff();
    link->origin.t = X.translation();
    link->origin.SetRotation(X.linear());
    link->origin.half_r.setConstant(half);
  }

  void ReadBody(const MjcfElement& body, int parent, std::string around) {
    around = ReadAttribute(body, "childclass", around);
    const int id = ++body_;
    if (id >= engine_.nbody) return;
    const std::string name = NameOf(engine_, mjOBJ_BODY, id);
    PrintedOrigin origin = ReadOrigin(body);
    TakeEngine(engine_.body_pos + 3 * id, engine_.body_quat + 4 * id, &origin);
    const int first = engine_.body_jntadr[id];
    const int count = engine_.body_jntnum[id];
    int k = 0;
    const auto add = [&](PrintedLink link) {
      link.parent = parent;
      link.name = k + 1 >= count ? name : name + ":" + link.joint.name;
      link.origin.form = RotationForm::kQuaternion;
      link.origin.r = Vector4d::UnitX();
      if (k == 0) link.origin = origin;
      if (count > 0) UndoReference(first + k, &link);
      if (k + 1 >= count) ReadInertial(body, id, &link);
      parent = robot_.Add(std::move(link));
      ++k;
    };
    for (const MjcfElement* child : ListChildren(&body)) {
      const std::string_view kind = child->Name();
      if ((kind != "joint" && kind != "freejoint") || k >= count) continue;
      PrintedLink link;
      link.joint = ReadJoint(*child, around, first + k);
      add(std::move(link));
    }
    if (k == 0) add(PrintedLink{});
    for (const MjcfElement* site : ListChildren(&body, "site")) {
      const std::string site_name = ReadAttribute(*site, "name");
      const int number = mj_name2id(&engine_, mjOBJ_SITE, site_name.c_str());
      if (site_name.empty() || number < 0) continue;
      PrintedLink frame;
      frame.name = site_name;
      frame.parent = parent;
      frame.is_frame = true;
      frame.origin = ReadOrigin(*site);
      TakeEngine(engine_.site_pos + 3 * number, engine_.site_quat + 4 * number, &frame.origin);
      frames_.push_back(std::move(frame));
    }
    for (const MjcfElement* child : ListChildren(&body, "body")) ReadBody(*child, parent, around);
  }

  /// Sites are frames on links; those that have a link's name are left out.
  void AddFrames() {
    for (PrintedLink& frame : frames_) {
      if (!Contains(robot_.links, frame.name, &PrintedLink::name)) robot_.Add(std::move(frame));
    }
  }

  void ReadEqualities() {
    for (const MjcfElement* equality : ListChildren(&root_, "equality")) {
      for (const MjcfElement* element : ListChildren(equality)) {
        const auto find = [&](const char* name) { return FindText(*element, "", name); };
        if (find("active") == "false") continue;
        if (std::string_view(element->Name()) == "joint" && !find("joint2").empty()) {
          ReadCoupling(find("joint1"), find("joint2"), find("polycoef"));
          continue;
        }
        std::string text = element->Name();
        for (const char* part : {"body1", "body2", "joint1", "tendon1", "tendon2", "geom1", "geom2"})
          text += find(part).empty() ? "" : " " + find(part);
        robot_.constraints.push_back(std::move(text));
      }
    }
  }

  void ReadCoupling(const std::string& joint, const std::string& leader, const std::string& polynomial) {
    const auto [numbers, halves] = ReadPrintedVector<4>(polynomial.empty() ? "0 1 0 0 0" : polynomial);
    for (PrintedLink& link : robot_.links) {
      if (link.joint.name == joint)
        link.joint.mimic = {leader, {numbers[1], halves[1]}, {numbers[0], halves[0]}};
    }
  }

  /// Tendons that exert forces.
  void ReadTendons() {
    for (int i = 0; i < engine_.ntendon; ++i) {
      std::string text;
      const auto add = [&](const char* name, double value) {
        if (value != 0.0) text += fmt::format("{}{} {:.6g}", text.empty() ? " of " : ", ", name, value);
      };
      add("stiffness", engine_.tendon_stiffness[i]);
      add("damping", engine_.tendon_damping[i]);
      add("friction", engine_.tendon_frictionloss[i]);
      if (engine_.tendon_limited[i] != 0) add("upper limit", engine_.tendon_range[2 * i + 1]);
      if (!text.empty()) robot_.constraints.push_back("tendon " + NameOf(engine_, mjOBJ_TENDON, i) + text);
    }
  }

  void ReadMotors() {
    for (int i = 0; i < engine_.nu; ++i) {
      if (engine_.actuator_trntype[i] != mjTRN_JOINT) continue;
      robot_.has_motors = true;
      PrintedMotor motor;
      motor.name = NameOf(engine_, mjOBJ_ACTUATOR, i);
      motor.link = IndexOf(robot_.links, NameOf(engine_, mjOBJ_JOINT, engine_.actuator_trnid[2 * i]),
                           [](const PrintedLink& link) { return link.joint.name; });
      motor.gear = engine_.actuator_gear[6 * i];
      const mjtNum* const bias = engine_.actuator_biasprm + mjNBIAS * i;
      if (engine_.actuator_biastype[i] != mjBIAS_NONE && (bias[1] != 0.0 || bias[2] != 0.0))
        motor.servo = fmt::format("(kp {:.6g}{})", 0.0 - bias[1],
                                  bias[2] == 0.0 ? "" : fmt::format(", kv {:.6g}", 0.0 - bias[2]));
      const std::optional<std::pair<double, double>> limits = FindForceLimits(engine_, i);
      if (limits && std::abs(limits->first + limits->second) <= 1e-9 * std::abs(limits->second))
        motor.effort = {std::abs(limits->second), kEngineDigits * std::abs(limits->second)};
      robot_.motors.push_back(std::move(motor));
    }
    TakeMotors(&robot_);
  }

  const MjcfElement& root_;
  const mjModel& engine_;
  DefaultClasses classes_;
  std::vector<CompiledChange> changes_;
  double unit_ = kDegree;
  std::array<char, 3> sequence_ = {'x', 'y', 'z'};
  PrintedRobot robot_;
  std::vector<PrintedLink> frames_;
  int body_ = 0;
};

}  // namespace

PrintedRobot ReadPrintedMjcf(const MjcfFile& mjcf, const mjModel& engine) {
  return PrintedMjcfReader(mjcf, engine).Read();
}

}  // namespace dexcheck
