#include "tests/harness/corrections/drawn_robot.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace dexcheck::testing {

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
  constexpr double kGimbal = 1e-9;
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  if (std::hypot(R(2, 1), R(2, 2)) < kGimbal) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
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
namespace {

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

std::string WriteDrawnUrdf(const DrawnRobot& robot, const Writer& w) {
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
  if (form.format == WrittenForm::Format::kUrdf) return WriteDrawnUrdf(written, Writer(form.digits));
  if (form.format == WrittenForm::Format::kToml) return WriteToml(written, Writer(form.digits));
  return MjcfText(written, form).Write();
}

const char* EndOf(const WrittenForm& form) {
  constexpr const char* kEnds[] = {".urdf", ".xml", ".toml"};
  return kEnds[static_cast<size_t>(form.format)];
}

}  // namespace dexcheck::testing
