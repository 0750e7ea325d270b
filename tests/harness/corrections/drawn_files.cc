#include "tests/harness/corrections/drawn_files.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace dexcheck::testing {
namespace {

using Random = std::mt19937;
using Kind = CorrectionKind;

double Draw(Random* random, double low, double high) {
  return std::uniform_real_distribution(low, high)(*random);
}
int DrawIndex(Random* random, int count) { return std::uniform_int_distribution(0, count - 1)(*random); }
Vector3d DrawVector(Random* random, double size) {
  return {Draw(random, -size, size), Draw(random, -size, size), Draw(random, -size, size)};
}

Matrix3d Turn(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Vector3d::UnitX()))
      .toRotationMatrix();
}
Vector3d SolveAngles(const Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
          std::atan2(R(1, 0), R(0, 0))};
}
Matrix3d Tensor(const Vector6d& e) {
  Matrix3d I;
  I << e[0], e[3], e[4], e[3], e[1], e[5], e[4], e[5], e[2];
  return I;
}
Vector6d Entries(const Matrix3d& I) {
  Vector6d e;
  e << I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  return e;
}
Pose MakePose(const Vector3d& t, const Matrix3d& R) {
  Pose X = Pose::Identity();
  X.translation() = t;
  X.linear() = R;
  return X;
}

class Writer {
 public:
  explicit Writer(int digits) : digits_(digits) {}
  [[nodiscard]] std::string Number(double value) const {
    if (std::abs(value) < 1e-12) value = 0.0;
    return fmt::format("{:.{}g}", value, digits_);
  }
  template <typename Vector>
  [[nodiscard]] std::string List(const Vector& v) const {
    std::string text;
    for (Eigen::Index i = 0; i < v.size(); ++i) text += (i > 0 ? " " : "") + Number(v[i]);
    return text;
  }

 private:
  int digits_;
};

std::string WriteUrdf(const DrawnRobot& robot, const Writer& w) {
  std::string text = "<robot name=\"drawn\">\n";
  for (const DrawnLink& link : robot.links) {
    text += fmt::format("  <link name=\"{}\">\n", link.name);
    if (link.has_inertial)
      text += fmt::format(
          "    <inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{}\"/><inertia ixx=\"{}\" iyy=\"{}\" "
          "izz=\"{}\" ixy=\"{}\" "
          "ixz=\"{}\" iyz=\"{}\"/></inertial>\n",
          w.List(link.com), w.List(link.com_rpy), w.Number(link.mass), w.Number(link.I[0]),
          w.Number(link.I[1]), w.Number(link.I[2]), w.Number(link.I[3]), w.Number(link.I[4]),
          w.Number(link.I[5]));
    text += "  </link>\n";
  }
  for (const DrawnLink& link : robot.links) {
    if (link.parent < 0) continue;
    const char* const type = link.type == 'f'   ? "fixed"
                             : link.type == 's' ? "prismatic"
                             : link.range       ? "revolute"
                                                : "continuous";
    text += fmt::format(
        "  <joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><origin xyz=\"{}\" "
        "rpy=\"{}\"/>",
        link.joint, type, robot.links[static_cast<size_t>(link.parent)].name, link.name, w.List(link.xyz),
        w.List(link.rpy));
    if (link.type != 'f') {
      text += fmt::format("<axis xyz=\"{}\"/>", w.List(link.axis));
      if (link.range)
        text += fmt::format("<limit lower=\"{}\" upper=\"{}\" effort=\"{}\" velocity=\"{}\"/>",
                            w.Number((*link.range)[0]), w.Number((*link.range)[1]), w.Number(link.effort),
                            w.Number(link.velocity));
      text += fmt::format("<dynamics damping=\"{}\" friction=\"{}\"/>", w.Number(link.damping),
                          w.Number(link.friction));
      if (link.leader >= 0)
        text += fmt::format("<mimic joint=\"{}\" multiplier=\"{}\"/>",
                            robot.links[static_cast<size_t>(link.leader)].joint, w.Number(link.multiplier));
    }
    text += "</joint>\n";
  }
  return text + "</robot>\n";
}

/// Takes other frames of links: X is each link's new frame in its old one.
void ChangeFrames(const std::vector<Pose>& X, DrawnRobot* robot) {
  for (size_t i = 0; i < robot->links.size(); ++i) {
    DrawnLink& link = robot->links[i];
    const Pose before = link.parent < 0 ? Pose::Identity() : X[static_cast<size_t>(link.parent)];
    const Pose origin = before.inverse() * MakePose(link.xyz, Turn(link.rpy)) * X[i];
    link.xyz = origin.translation();
    link.rpy = SolveAngles(origin.linear());
    link.axis = X[i].linear().transpose() * link.axis;
    link.com = X[i].inverse() * link.com;
    link.com_rpy = SolveAngles(X[i].linear().transpose() * Turn(link.com_rpy));
  }
}

/// Makes fixed links part of what carries them.
void Fuse(DrawnRobot* robot) {
  for (size_t i = robot->links.size(); i-- > 1;) {
    const DrawnLink link = robot->links[i];
    if (link.type != 'f') continue;
    DrawnLink& carrier = robot->links[static_cast<size_t>(link.parent)];
    const Pose X = MakePose(link.xyz, Turn(link.rpy));
    const auto index = static_cast<int>(i);
    for (DrawnLink& other : robot->links) {
      if (other.parent == index) {
        const Pose origin = X * MakePose(other.xyz, Turn(other.rpy));
        other.xyz = origin.translation();
        other.rpy = SolveAngles(origin.linear());
        other.parent = link.parent;
      }
    }
    if (link.has_inertial) {
      const auto point = [](double m, const Vector3d& c) {
        return Matrix3d(m * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose()));
      };
      const Matrix3d R = Turn(carrier.com_rpy);
      const Matrix3d Q = X.linear() * Turn(link.com_rpy);
      const Vector3d c = X * link.com;
      const double mass = carrier.mass + link.mass;
      const Vector3d com = (carrier.mass * carrier.com + link.mass * c) / mass;
      const Matrix3d I = R * Tensor(carrier.I) * R.transpose() + Q * Tensor(link.I) * Q.transpose() +
                         point(carrier.mass, carrier.com - com) + point(link.mass, c - com);
      carrier.mass = mass;
      carrier.com = com;
      carrier.com_rpy.setZero();
      carrier.I = Entries(I);
    }
    robot->links.erase(robot->links.begin() + index);
    for (DrawnLink& other : robot->links) {
      if (other.parent > index) --other.parent;
      if (other.leader > index) --other.leader;
    }
  }
}

class MjcfText {
 public:
  MjcfText(const DrawnRobot& robot, const WrittenForm& form) : robot_(robot), form_(form), w_(form.digits) {}

  std::string Write() {
    std::string text = fmt::format(
        "<mujoco model=\"drawn\">\n<compiler angle=\"radian\" eulerseq=\"XYZ\"/>\n<option gravity=\"0 0 "
        "{}\"/>\n<worldbody>\n",
        w_.Number(-robot_.gravity));
    Body(0, &text);
    text += "</worldbody>\n<equality>\n";
    for (const DrawnLink& link : robot_.links) {
      if (link.leader >= 0)
        text += fmt::format("<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"0 {} 0 0 0\"/>\n", link.joint,
                            robot_.links[static_cast<size_t>(link.leader)].joint, w_.Number(link.multiplier));
    }
    text += "</equality>\n";
    if (form_.motors) {
      text += "<actuator>\n";
      for (const DrawnLink& link : robot_.links) {
        if (link.parent >= 0 && link.type != 'f' && link.gear != 0.0)
          text += fmt::format("<motor joint=\"{}\" gear=\"{}\"/>\n", link.joint, w_.Number(link.gear));
      }
      text += "</actuator>\n";
    }
    return text + "</mujoco>\n";
  }

 private:
  [[nodiscard]] std::string Rotation(const Vector3d& rpy) const {
    if (rpy.isZero()) return "";
    if (form_.euler) return fmt::format(" euler=\"{}\"", w_.List(rpy));
    const Eigen::Quaterniond q(Turn(rpy));
    return fmt::format(" quat=\"{}\"", w_.List(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())));
  }

  void Body(size_t i, std::string* text) const {
    const DrawnLink& link = robot_.links[i];
    *text +=
        fmt::format("<body name=\"{}{}\" pos=\"{}\"{}>\n", form_.other_names ? "body_of_" : "",
                    form_.other_names ? std::to_string(i) : link.name, w_.List(link.xyz), Rotation(link.rpy));
    if (link.has_inertial) {
      if (form_.principal) {
        const Matrix3d R = Turn(link.com_rpy);
        const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(R * Tensor(link.I) * R.transpose());
        Matrix3d V = solver.eigenvectors();
        if (V.determinant() < 0.0) V.col(0) *= -1.0;
        const Eigen::Quaterniond q(V);
        *text += fmt::format("<inertial mass=\"{}\" pos=\"{}\" quat=\"{}\" diaginertia=\"{}\"/>\n",
                             w_.Number(link.mass), w_.List(link.com),
                             w_.List(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())),
                             w_.List(Vector3d(solver.eigenvalues())));
      } else {
        const Matrix3d R = Turn(link.com_rpy);
        *text += fmt::format("<inertial mass=\"{}\" pos=\"{}\" fullinertia=\"{}\"/>\n", w_.Number(link.mass),
                             w_.List(link.com), w_.List(Entries(R * Tensor(link.I) * R.transpose())));
      }
    }
    if (link.parent >= 0 && link.type != 'f') {
      *text += fmt::format(
          "<joint name=\"{}\" type=\"{}\" axis=\"{}\" damping=\"{}\" frictionloss=\"{}\" armature=\"{}\"",
          link.joint, link.type == 's' ? "slide" : "hinge", w_.List(link.axis), w_.Number(link.damping),
          w_.Number(link.friction), w_.Number(link.armature));
      if (link.range)
        *text += fmt::format(" limited=\"true\" range=\"{} {}\"", w_.Number((*link.range)[0]),
                             w_.Number((*link.range)[1]));
      *text += "/>\n";
    }
    for (size_t k = i + 1; k < robot_.links.size(); ++k) {
      if (robot_.links[k].parent == static_cast<int>(i)) Body(k, text);
    }
    *text += "</body>\n";
  }

  const DrawnRobot& robot_;
  const WrittenForm& form_;
  Writer w_;
};

/// A parameter file: a chain for each joint. It states no limits of motors.
std::string WriteToml(const DrawnRobot& robot, const Writer& w) {
  const auto list = [&](const auto& v) {
    std::string text;
    for (Eigen::Index i = 0; i < v.size(); ++i) text += (i > 0 ? ", " : "") + w.Number(v[i]);
    return "[" + text + "]";
  };
  std::string text =
      fmt::format("name = \"drawn\"\ngravity = [0, 0, {}]\n[base]\ntype = \"fixed\"\nlink = \"{}\"\n",
                  w.Number(-robot.gravity), robot.links[0].name);
  for (const DrawnLink& link : robot.links) {
    if (link.parent < 0) continue;
    const Matrix3d R = Turn(link.com_rpy);
    text += fmt::format(
        "[[chain]]\nparent = \"{}\"\nrows = [{{ joint = \"{}\", link = \"{}\", xyz = {}, rpy = {}, axis = "
        "{}{} "
        "}}]\n[chain.joints]\n\"{}\" = {{ {}damping = {}, armature = {}, dry_friction = {}{} "
        "}}\n[chain.links.\"{}\"]\nmass = "
        "{}\ncom = {}\ninertia = {}\n",
        robot.links[static_cast<size_t>(link.parent)].name, link.joint, link.name, list(link.xyz),
        list(link.rpy), list(link.axis), link.type == 's' ? ", type = \"prismatic\"" : "", link.joint,
        link.range ? fmt::format("range = [{}, {}], ", w.Number((*link.range)[0]), w.Number((*link.range)[1]))
                   : "",
        w.Number(link.damping), w.Number(link.armature), w.Number(link.friction),
        link.leader < 0
            ? ""
            : fmt::format(", mimic = {{ joint = \"{}\", multiplier = {} }}",
                          robot.links[static_cast<size_t>(link.leader)].joint, w.Number(link.multiplier)),
        link.name, w.Number(link.mass), list(link.com), list(Entries(R * Tensor(link.I) * R.transpose())));
  }
  return text;
}

// Faults.

struct Spoiling {
  const WrittenForm& form;
  Random* random;
  DrawnRobot* robot;

  [[nodiscard]] std::vector<size_t> List(const std::function<bool(const DrawnLink&)>& concerns) const {
    std::vector<size_t> found;
    for (size_t i = 0; i < robot->links.size(); ++i) {
      if (concerns(robot->links[i])) found.push_back(i);
    }
    return found;
  }
};

bool IsJoint(const DrawnLink& link) { return link.parent >= 0 && link.type != 'f'; }
bool IsPlaced(const DrawnLink& link) { return link.parent >= 0; }
bool IsBody(const DrawnLink& link) { return link.parent >= 0 && link.has_inertial && link.mass > 0.0; }
bool IsTurned(const DrawnLink& link) { return link.parent >= 0 && link.rpy.norm() > 0.1; }

/// A fault of one link; it may be made at several.
struct FaultMaker {
  SiteKind of;
  std::vector<Kind> kinds;
  bool (*concerns)(const DrawnLink&);
  void (*make)(Random*, DrawnLink*);
};

double DrawFactor(Random* random) {
  const double size = Draw(random, 0.05, 0.6);
  return DrawIndex(random, 2) == 0 ? 1.0 + size : 1.0 / (1.0 + size);
}

const std::map<std::string, FaultMaker>& ListMakers() {
  static const std::map<std::string, FaultMaker> makers = {
      {"mass_grams", {SiteKind::kMass, {Kind::kUnit}, IsBody, [](Random*, DrawnLink* l) { l->mass *= 1e3; }}},
      {"mass_number",
       {SiteKind::kMass, {Kind::kNumber}, IsBody, [](Random* r, DrawnLink* l) { l->mass *= DrawFactor(r); }}},
      {"mass_pounds",
       {SiteKind::kMass, {Kind::kUnit}, IsBody, [](Random*, DrawnLink* l) { l->mass /= 0.45359237; }}},
      {"com_mm", {SiteKind::kCom, {Kind::kUnit}, IsBody, [](Random*, DrawnLink* l) { l->com *= 1e3; }}},
      {"com_sign", {SiteKind::kCom, {Kind::kSign}, IsBody, [](Random*, DrawnLink* l) { l->com *= -1.0; }}},
      {"com_sign_x",
       {SiteKind::kCom, {Kind::kSignOf}, IsBody, [](Random*, DrawnLink* l) { l->com[0] *= -1.0; }}},
      {"com_xy",
       {SiteKind::kCom,
        {Kind::kPermutation},
        IsBody,
        [](Random*, DrawnLink* l) { std::swap(l->com[0], l->com[1]); }}},
      {"com_number",
       {SiteKind::kCom,
        {Kind::kNumber},
        IsBody,
        [](Random* r, DrawnLink* l) { l->com[DrawIndex(r, 3)] += Draw(r, 0.003, 0.03); }}},
      {"com_dropped",
       {SiteKind::kCom, {Kind::kMissing}, IsBody, [](Random*, DrawnLink* l) { l->com.setZero(); }}},
      {"com_in_parent",
       {SiteKind::kCom,
        {Kind::kInParent},
        IsBody,
        [](Random*, DrawnLink* l) { l->com = Turn(l->rpy) * l->com + l->xyz; }}},
      {"com_parent_axes",
       {SiteKind::kCom,
        {Kind::kAlongParent},
        [](const DrawnLink& l) { return IsBody(l) && IsTurned(l); },
        [](Random*, DrawnLink* l) { l->com = Turn(l->rpy) * l->com; }}},
      {"inertia_gmm2",
       {SiteKind::kInertia, {Kind::kUnit}, IsBody, [](Random*, DrawnLink* l) { l->I *= 1e9; }}},
      {"inertia_doubled",
       {SiteKind::kInertia, {Kind::kUnit}, IsBody, [](Random*, DrawnLink* l) { l->I *= 2.0; }}},
      {"inertia_at_origin",
       {SiteKind::kInertia,
        {Kind::kAboutOrigin},
        [](const DrawnLink& l) { return IsBody(l) && l.com_rpy.isZero(); },
        [](Random*, DrawnLink* l) {
          l->I +=
              Entries(l->mass * (l->com.squaredNorm() * Matrix3d::Identity() - l->com * l->com.transpose()));
        }}},
      {"products_sign",
       {SiteKind::kInertia,
        {Kind::kProductSigns},
        IsBody,
        [](Random*, DrawnLink* l) { l->I.tail<3>() *= -1.0; }}},
      {"product_sign",
       {SiteKind::kInertia,
        {Kind::kProductSign},
        IsBody,
        [](Random* r, DrawnLink* l) { l->I[3 + DrawIndex(r, 3)] *= -1.0; }}},
      {"products_dropped",
       {SiteKind::kInertia,
        {Kind::kNoProducts},
        IsBody,
        [](Random*, DrawnLink* l) { l->I.tail<3>().setZero(); }}},
      {"moments_xy",
       {SiteKind::kInertia,
        {Kind::kMoments},
        IsBody,
        [](Random*, DrawnLink* l) { std::swap(l->I[0], l->I[1]); }}},
      {"inertia_number",
       {SiteKind::kInertia,
        {Kind::kNumber},
        IsBody,
        [](Random* r, DrawnLink* l) { l->I[DrawIndex(r, 3)] *= DrawFactor(r); }}},
      {"inertia_axes_dropped",
       {SiteKind::kInertia,
        {Kind::kNoAxes, Kind::kFrame},
        [](const DrawnLink& l) { return IsBody(l) && !l.com_rpy.isZero(); },
        [](Random*, DrawnLink* l) { l->com_rpy.setZero(); }}},
      {"inertia_parent_axes",
       {SiteKind::kInertia,
        {Kind::kAlongParent},
        [](const DrawnLink& l) { return IsBody(l) && IsTurned(l) && l.com_rpy.isZero(); },
        [](Random*, DrawnLink* l) {
          l->I = Entries(Turn(l->rpy) * Tensor(l->I) * Turn(l->rpy).transpose());
        }}},
      {"place_mm",
       {SiteKind::kPosition, {Kind::kUnit}, IsPlaced, [](Random*, DrawnLink* l) { l->xyz *= 1e3; }}},
      {"place_sign",
       {SiteKind::kPosition,
        {Kind::kSignOf, Kind::kSign},
        IsPlaced,
        [](Random* r, DrawnLink* l) { l->xyz[DrawIndex(r, 3)] *= -1.0; }}},
      {"place_number",
       {SiteKind::kPosition,
        {Kind::kNumber},
        IsPlaced,
        [](Random* r, DrawnLink* l) { l->xyz[DrawIndex(r, 3)] += Draw(r, 0.002, 0.05); }}},
      {"place_dropped",
       {SiteKind::kPosition, {Kind::kMissing}, IsPlaced, [](Random*, DrawnLink* l) { l->xyz.setZero(); }}},
      {"place_yz",
       {SiteKind::kPosition,
        {Kind::kPermutation},
        IsPlaced,
        [](Random*, DrawnLink* l) { std::swap(l->xyz[1], l->xyz[2]); }}},
      {"rpy_degrees",
       {SiteKind::kRotation,
        {Kind::kDegrees, Kind::kAngleDegrees},
        IsTurned,
        [](Random*, DrawnLink* l) { l->rpy *= 180.0 / kPi; }}},
      {"rpy_dropped",
       {SiteKind::kRotation, {Kind::kMissing}, IsTurned, [](Random*, DrawnLink* l) { l->rpy.setZero(); }}},
      {"rpy_reversed",
       {SiteKind::kRotation,
        {Kind::kAnglesReversed, Kind::kAnglesPermuted},
        IsTurned,
        [](Random*, DrawnLink* l) { std::swap(l->rpy[0], l->rpy[2]); }}},
      {"rpy_sign",
       {SiteKind::kRotation,
        {Kind::kAngleSign, Kind::kTransposed, Kind::kMirror},
        IsTurned,
        [](Random* r, DrawnLink* l) { l->rpy[DrawIndex(r, 3)] *= -1.0; }}},
      {"rpy_number",
       {SiteKind::kRotation,
        {Kind::kNumber, Kind::kZero},
        IsPlaced,
        [](Random* r, DrawnLink* l) { l->rpy[DrawIndex(r, 3)] += Draw(r, 0.02, 0.4); }}},
      {"rotation_inverse",
       {SiteKind::kRotation,
        {Kind::kTransposed, Kind::kAngleSign},
        IsTurned,
        [](Random*, DrawnLink* l) { l->rpy = SolveAngles(Turn(l->rpy).transpose()); }}},
      {"rotation_order",
       {SiteKind::kRotation,
        {Kind::kMovingAxes, Kind::kFixedAxes},
        IsTurned,
        [](Random*, DrawnLink* l) {
          l->rpy = SolveAngles((Eigen::AngleAxisd(l->rpy[0], Vector3d::UnitX()) *
                                Eigen::AngleAxisd(l->rpy[1], Vector3d::UnitY()) *
                                Eigen::AngleAxisd(l->rpy[2], Vector3d::UnitZ()))
                                   .toRotationMatrix());
        }}},
      {"zero_offset",
       {SiteKind::kRotation,
        {Kind::kZero, Kind::kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.type == 'h'; },
        [](Random* r, DrawnLink* l) {
          l->rpy = SolveAngles(Turn(l->rpy) * Eigen::AngleAxisd(Draw(r, 0.05, 0.8), l->axis.normalized()));
        }}},
      {"rotation_oblique",
       {SiteKind::kRotation,
        {Kind::kNumber, Kind::kSurplus},
        IsPlaced,
        [](Random* r, DrawnLink* l) {
          l->rpy = SolveAngles(Turn(l->rpy) *
                               Eigen::AngleAxisd(Draw(r, 0.05, 0.4), DrawVector(r, 1.0).normalized()));
        }}},
      {"axis_sign",
       {SiteKind::kAxis, {Kind::kSign}, IsJoint, [](Random*, DrawnLink* l) { l->axis *= -1.0; }}},
      {"axis_other",
       {SiteKind::kAxis,
        {Kind::kOtherAxis, Kind::kPermutation},
        IsJoint,
        [](Random*, DrawnLink* l) { l->axis = Vector3d(l->axis[1], l->axis[2], l->axis[0]); }}},
      {"range_number",
       {SiteKind::kRange,
        {Kind::kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.range; },
        [](Random* r, DrawnLink* l) { (*l->range)[1] *= DrawFactor(r); }}},
      {"range_degrees",
       {SiteKind::kRange,
        {Kind::kUnit},
        [](const DrawnLink& l) { return IsJoint(l) && l.range && l.type == 'h'; },
        [](Random*, DrawnLink* l) {
          for (double& x : *l->range) x *= 180.0 / kPi;
        }}},
      {"range_turned",
       {SiteKind::kRange,
        {Kind::kSign},
        [](const DrawnLink& l) { return IsJoint(l) && l.range; },
        [](Random*, DrawnLink* l) {
          l->range = {-(*l->range)[1], -(*l->range)[0]};
        }}},
      {"range_dropped",
       {SiteKind::kRange,
        {Kind::kMissing},
        [](const DrawnLink& l) { return IsJoint(l) && l.range && l.type == 'h'; },
        [](Random*, DrawnLink* l) { l->range.reset(); }}},
      {"damping_number",
       {SiteKind::kDamping,
        {Kind::kNumber, Kind::kUnit},
        IsJoint,
        [](Random* r, DrawnLink* l) { l->damping *= DrawFactor(r); }}},
      {"damping_dropped",
       {SiteKind::kDamping,
        {Kind::kMissing, Kind::kNumber},
        IsJoint,
        [](Random*, DrawnLink* l) { l->damping = 0.0; }}},
      {"friction_number",
       {SiteKind::kFriction,
        {Kind::kNumber, Kind::kUnit},
        IsJoint,
        [](Random* r, DrawnLink* l) { l->friction *= DrawFactor(r); }}},
      {"type_other",
       {SiteKind::kType,
        {Kind::kNumber},
        [](const DrawnLink& l) { return IsJoint(l) && l.leader < 0 && l.range; },
        [](Random*, DrawnLink* l) { l->type = l->type == 'h' ? 's' : 'h'; }}},
      {"mimic_number",
       {SiteKind::kMimic,
        {Kind::kNumber},
        [](const DrawnLink& l) { return l.leader >= 0; },
        [](Random*, DrawnLink* l) { l->multiplier *= 2.0; }}},
      {"mimic_dropped",
       {SiteKind::kMimic,
        {Kind::kMissing},
        [](const DrawnLink& l) { return l.leader >= 0; },
        [](Random*, DrawnLink* l) { l->leader = -1; }}},
      {"inertial_dropped",
       {SiteKind::kMass,
        {Kind::kMissing, Kind::kPartMissing},
        [](const DrawnLink& l) { return IsBody(l) && l.type != 'f'; },
        [](Random*, DrawnLink* l) { l->has_inertial = false; }}},
  };
  return makers;
}

std::string PlaceOf(const FaultMaker& maker, const DrawnLink& link) {
  return maker.of >= SiteKind::kMass ? "link " + link.name : "joint " + link.joint;
}

double Compare(const DrawnLink& a, const DrawnLink& b) {
  const auto far = [](double x, double y) { return std::abs(x - y) / (1e-9 + std::abs(x) + std::abs(y)); };
  double apart =
      far(a.mass, b.mass) + (a.com - b.com).norm() / 0.05 + (a.I - b.I).norm() / b.I.head<3>().sum();
  apart += (a.xyz - b.xyz).norm() + (Turn(a.rpy) - Turn(b.rpy)).norm() + (a.axis - b.axis).norm() +
           far(a.damping, b.damping) + far(a.friction, b.friction);
  const Matrix3d R = Turn(a.com_rpy), Q = Turn(b.com_rpy);
  apart += (R * Tensor(a.I) * R.transpose() - Q * Tensor(b.I) * Q.transpose()).norm() / b.I.head<3>().sum();
  if (a.range.has_value() != b.range.has_value() || a.leader != b.leader || a.type != b.type ||
      a.multiplier != b.multiplier || a.has_inertial != b.has_inertial)
    apart += 1.0;
  if (a.range && b.range)
    apart += std::abs((*a.range)[0] - (*b.range)[0]) + std::abs((*a.range)[1] - (*b.range)[1]);
  return apart;
}

/// An MJCF has no joint at a link that is welded.
void NamePlacesByLinks(const DrawnRobot& robot, MadeFault* made) {
  for (std::string& place : made->places) {
    for (const DrawnLink& link : robot.links) {
      if (link.type == 'f' && place == "joint " + link.joint) place = "link " + link.name;
    }
  }
}

}  // namespace

DrawnRobot DrawRobot(Random* random) {
  DrawnRobot robot;
  DrawnLink root;
  root.name = "base_link";
  root.has_inertial = false;
  robot.links.push_back(root);
  const int count = 3 + DrawIndex(random, 6);
  const auto add = [&](int parent, char type) {
    DrawnLink link;
    const size_t number = robot.links.size();
    link.name = fmt::format("part{}", number);
    link.joint = fmt::format("q{}", number);
    link.parent = parent;
    link.type = type;
    link.xyz = DrawVector(random, 0.3);
    const int style = DrawIndex(random, 4);
    if (style == 0) link.rpy = DrawVector(random, 1.3);
    if (style == 1) link.rpy[DrawIndex(random, 3)] = kPi / 2.0;
    if (style == 2) link.rpy = Vector3d(Draw(random, 0.2, 1.5), 0.0, Draw(random, -1.5, -0.2));
    link.axis = Vector3d::Unit(DrawIndex(random, 3));
    if (type == 's' || DrawIndex(random, 5) > 0)
      link.range = {Draw(random, -2.9, -0.5), Draw(random, 0.6, 2.5)};
    link.damping = Draw(random, 0.05, 2.0);
    link.friction = Draw(random, 0.05, 1.0);
    link.effort = Draw(random, 10.0, 90.0);
    link.velocity = Draw(random, 1.0, 5.0);
    link.mass = Draw(random, 0.2, 5.0);
    link.com = DrawVector(random, 0.12);
    if (DrawIndex(random, 3) == 0) link.com_rpy = DrawVector(random, 1.2);
    const Vector3d second =
        Vector3d(Draw(random, 0.3, 1.0), Draw(random, 0.3, 1.0), Draw(random, 0.3, 1.0)) * link.mass * 0.003;
    const Matrix3d R = Turn(DrawVector(random, 0.5));
    const Matrix3d moments =
        Vector3d(second[1] + second[2], second[0] + second[2], second[0] + second[1]).asDiagonal();
    link.I = Entries(R * moments * R.transpose());
    robot.links.push_back(link);
    return static_cast<int>(number);
  };
  int last = 0;
  for (int i = 0; i < count; ++i) {
    int parent = last;
    if (i > 1 && DrawIndex(random, 5) == 0) parent = DrawIndex(random, static_cast<int>(robot.links.size()));
    last = add(parent, DrawIndex(random, 6) == 0 ? 's' : 'h');
    if (DrawIndex(random, 5) == 0) {
      const int fixed = add(last, 'f');
      if (DrawIndex(random, 2) == 0) last = fixed;
    }
  }
  const int leader = 1;
  if (count > 4 && DrawIndex(random, 2) == 0 &&
      robot.links[static_cast<size_t>(last)].type == robot.links[1].type) {
    robot.links[static_cast<size_t>(last)].leader = leader;
    robot.links[static_cast<size_t>(last)].multiplier = 1.5;
  }
  return robot;
}

std::string WriteRobot(const DrawnRobot& robot, const WrittenForm& form) {
  DrawnRobot written = robot;
  if (form.fuses || form.format == WrittenForm::Format::kToml) Fuse(&written);
  if (form.other_frames) {
    Random random(form.seed);
    std::vector<Pose> X;
    for (const DrawnLink& link : written.links) {
      X.push_back(link.parent < 0 ? Pose::Identity()
                                  : MakePose(DrawVector(&random, 0.1), Turn(DrawVector(&random, 1.2))));
      // The joint's axis goes through the origin.
      if (link.parent >= 0 && link.type != 'f')
        X.back().translation() = link.axis.normalized() * Draw(&random, -0.1, 0.1);
    }
    ChangeFrames(X, &written);
  }
  if (form.format == WrittenForm::Format::kUrdf) return WriteUrdf(written, Writer(form.digits));
  if (form.format == WrittenForm::Format::kToml) return WriteToml(written, Writer(form.digits));
  return MjcfText(written, form).Write();
}

const char* EndOf(const WrittenForm& form) {
  constexpr const char* kEnds[] = {".urdf", ".xml", ".toml"};
  return kEnds[static_cast<size_t>(form.format)];
}

std::vector<std::string> ListFaultNames() {
  std::vector<std::string> names;
  for (const auto& [name, maker] : ListMakers()) names.push_back(name);
  for (const char* all : {"all com_mm", "all products_sign", "all inertia_at_origin", "all rpy_degrees",
                          "all damping_dropped", "all inertia_gmm2", "all rotation_order"})
    names.emplace_back(all);
  for (const char* whole : {"inertials_exchanged", "names_exchanged", "gravity_number", "last_link_missing",
                            "payload_missing", "places_exchanged"})
    names.emplace_back(whole);
  return names;
}

std::optional<MadeFault> MakeFault(const std::string& name, const WrittenForm& form, Random* random,
                                   DrawnRobot* robot) {
  const DrawnRobot before = *robot;
  MadeFault made;
  made.name = name;
  const bool is_mjcf = form.format == WrittenForm::Format::kMjcf;
  const Spoiling spoiling{form, random, robot};
  const auto pick = [&](const std::vector<size_t>& from) {
    return from[static_cast<size_t>(DrawIndex(random, static_cast<int>(from.size())))];
  };
  if (name == "inertials_exchanged" || name == "places_exchanged") {
    const bool bodies = name == "inertials_exchanged";
    const std::vector<size_t> links = spoiling.List(bodies ? IsBody : IsPlaced);
    if (links.size() < 2) return std::nullopt;
    const size_t i = pick(links);
    const size_t k = pick(links);
    if (i == k) return std::nullopt;
    DrawnLink& a = robot->links[i];
    DrawnLink& b = robot->links[k];
    if (bodies) {
      std::swap(a.mass, b.mass);
      std::swap(a.com, b.com);
      std::swap(a.com_rpy, b.com_rpy);
      std::swap(a.I, b.I);
    } else {
      std::swap(a.xyz, b.xyz);
      std::swap(a.rpy, b.rpy);
    }
    made.of = bodies ? SiteKind::kMass : SiteKind::kPosition;
    made.kinds = {Kind::kExchanged};
    made.places = bodies ? std::vector<std::string>{"link " + a.name, "link " + b.name}
                         : std::vector<std::string>{"joint " + a.joint, "joint " + b.joint};
    made.any_place = true;
    if (is_mjcf) NamePlacesByLinks(*robot, &made);
    return made;
  }
  if (name == "names_exchanged") {
    const std::vector<size_t> links =
        spoiling.List([](const DrawnLink& l) { return IsJoint(l) && l.leader < 0; });
    if (links.size() < 3) return std::nullopt;
    const size_t i = pick(links);
    const size_t k = pick(links);
    if (i == k || i == 1 || k == 1) return std::nullopt;
    std::swap(robot->links[i].joint, robot->links[k].joint);
    made.of = SiteKind::kName;
    made.kinds = {Kind::kExchanged};
    made.places = {"joint " + robot->links[i].joint, "joint " + robot->links[k].joint};
    made.any_place = true;
    return made;
  }
  if (name == "gravity_number") {
    if (!is_mjcf) return std::nullopt;
    robot->gravity *= 1.02;
    made.of = SiteKind::kGravity;
    made.kinds = {Kind::kNumber};
    made.places = {"robot"};
    return made;
  }
  if (name == "last_link_missing" || name == "payload_missing") {
    const auto last = static_cast<int>(robot->links.size()) - 1;
    if (std::ranges::any_of(robot->links, [&](const DrawnLink& l) { return l.parent == last; }))
      return std::nullopt;
    const DrawnLink link = robot->links.back();
    if ((link.type == 'f') != (name == "payload_missing")) return std::nullopt;
    robot->links.pop_back();
    made.of = link.type == 'f' ? SiteKind::kMass : SiteKind::kPresence;
    made.kinds = {link.type == 'f' ? Kind::kPartMissing : Kind::kMissing};
    made.places = {link.type == 'f' ? "link " + robot->links[static_cast<size_t>(link.parent)].name
                                    : "joint " + link.joint};
    return made;
  }
  const bool all = name.starts_with("all ");
  const FaultMaker& maker = ListMakers().at(all ? name.substr(4) : name);
  if (is_mjcf && (maker.of == SiteKind::kEffort || name.find("degrees") != std::string::npos ||
                  name.find("rpy_reversed") != std::string::npos))
    return std::nullopt;
  if (!is_mjcf && name == "range_dropped") return std::nullopt;
  if (is_mjcf && (form.principal && maker.of == SiteKind::kInertia)) return std::nullopt;
  std::vector<size_t> links = spoiling.List(maker.concerns);
  // An MJCF has the tensor along the link's axes only.
  if (is_mjcf && maker.of == SiteKind::kInertia)
    std::erase_if(links, [&](size_t i) { return !robot->links[i].com_rpy.isZero(); });
  if (links.empty() || (all && links.size() < 2)) return std::nullopt;
  const std::vector<size_t> wrong = all ? links : std::vector<size_t>{pick(links)};
  constexpr double kVisible = 5e-3;
  for (const size_t i : wrong) {
    maker.make(random, &robot->links[i]);
    if (Compare(robot->links[i], before.links[i]) > kVisible)
      made.places.push_back(PlaceOf(maker, robot->links[i]));
    else
      made.hardly.push_back(PlaceOf(maker, robot->links[i]));
  }
  if (made.places.empty()) {
    *robot = before;
    return std::nullopt;
  }
  made.of = maker.of;
  made.kinds = maker.kinds;
  if (is_mjcf && (maker.of == SiteKind::kRotation || maker.of == SiteKind::kPosition)) {
    if (!form.euler && maker.of == SiteKind::kRotation)
      made.kinds.insert(made.kinds.end(), {Kind::kNumber, Kind::kMirror, Kind::kTransposed});
    NamePlacesByLinks(*robot, &made);
  }
  return made;
}

}  // namespace dexcheck::testing
