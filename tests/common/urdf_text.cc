#include "tests/common/urdf_text.h"

#include <fmt/format.h>

#include <vector>

#include "controller/model/rigid_body.h"

namespace dexcheck::testing {
namespace {

Matrix3d DrawRollPitchYaw(std::mt19937* random) {
  const auto draw = [random](double size) {
    return std::uniform_real_distribution<double>(-size, size)(*random);
  };
  // Away from pitch = 90 degrees, where roll and yaw lose digits.
  const Vector3d rpy(draw(3.0), draw(1.2), draw(3.0));
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

std::string WriteOrigin(const Pose& X) {
  const Vector3d ypr = X.linear().eulerAngles(2, 1, 0);
  const Vector3d p = X.translation();
  return fmt::format(R"(<origin xyz="{:.17g} {:.17g} {:.17g}" rpy="{:.17g} {:.17g} {:.17g}"/>)", p.x(), p.y(),
                     p.z(), ypr[2], ypr[1], ypr[0]);
}

/// @param X_LC where the inertial's frame stands; its origin is the centre of mass.
std::string WriteInertial(const MassProperties& body, const Pose& X_LC) {
  const Matrix3d I = X_LC.linear().transpose() * body.inertia * X_LC.linear();
  return fmt::format(
      R"(<inertial>{}<mass value="{:.17g}"/><inertia ixx="{:.17g}" ixy="{:.17g}" ixz="{:.17g}" )"
      R"(iyy="{:.17g}" iyz="{:.17g}" izz="{:.17g}"/></inertial>)",
      WriteOrigin(X_LC), body.mass, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2));
}

Pose CalcHome(const Joint& joint) {
  return joint.X_PB * CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q, joint.mdh.d);
}

class UrdfWriter {
 public:
  UrdfWriter(RobotSpec* spec, std::mt19937* random, double dry_friction)
      : spec_(*spec), random_(random), dry_friction_(dry_friction) {}

  std::string Write() {
    // The root stands for the world, the base's link where it is fixed to it; or it floats.
    text_ = fmt::format("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", spec_.name);
    if (spec_.base.type == BaseType::kFloating) {
      AddBody(spec_.base.link, spec_.base.body, Pose::Identity());
    } else {
      text_ += fmt::format("<link name=\"world\"/>\n<link name=\"{}\"/>\n", spec_.base.link);
      AddJoint("world_fixed", "fixed", "world", spec_.base.link, spec_.base.X_B0, "");
    }
    // Frames turned about the joint's axis point stay on the axis, as the joint's own frame must.
    for (size_t i = 0; i < spec_.joints.size(); ++i) {
      Pose X_iL = Pose::Identity();
      if (random_ != nullptr) X_iL.linear() = DrawRollPitchYaw(random_);
      own_frames_.push_back(X_iL);
    }
    for (size_t i = 0; i < spec_.joints.size(); ++i) AddMovingJoint(i);
    for (const Frame& frame : spec_.frames) AddFrame(frame);
    return text_ + "</robot>\n";
  }

 private:
  void AddJoint(const std::string& name, const std::string& type, const std::string& parent,
                const std::string& child, const Pose& X, const std::string& content) {
    text_ +=
        fmt::format("<joint name=\"{}\" type=\"{}\">{}<parent link=\"{}\"/><child link=\"{}\"/>{}</joint>\n",
                    name, type, WriteOrigin(X), parent, child, content);
  }

  [[nodiscard]] std::string LinkName(int joint) const {
    return joint < 0 ? spec_.base.link : spec_.joints[static_cast<size_t>(joint)].link;
  }
  [[nodiscard]] Pose OwnFrame(int joint) const {
    return joint < 0 ? Pose::Identity() : own_frames_[static_cast<size_t>(joint)];
  }

  void AddMovingJoint(size_t index) {
    Joint& joint = spec_.joints[index];
    const Pose& X_iL = own_frames_[index];
    const Vector3d axis = X_iL.linear().row(2).transpose();
    const Pose X_PL = OwnFrame(joint.parent).inverse() * CalcHome(joint) * X_iL;
    AddBody(joint.link, joint.body, X_iL);
    if (random_ != nullptr && index % 3 == 1) AddWeldedBody(index);
    std::string content = fmt::format(
        R"(<axis xyz="{:.17g} {:.17g} {:.17g}"/><limit lower="{:.17g}" upper="{:.17g}" effort="1" )"
        R"(velocity="1"/><dynamics damping="{:.17g}" friction="{:.17g}"/>)",
        axis.x(), axis.y(), axis.z(), joint.lower, joint.upper, joint.damping, dry_friction_);
    AddJoint(joint.name, joint.type == JointType::kRevolute ? "revolute" : "prismatic",
             LinkName(joint.parent), joint.link, X_PL, content);
  }

  /// @param X_iL the link's own frame in the frame that `body` is given in.
  void AddBody(const std::string& name, const MassProperties& body, const Pose& X_iL) {
    const MassProperties own = ExpressIn(body, X_iL.inverse());
    Pose X_LC = Pose::Identity();
    X_LC.translation() = own.com;
    if (random_ != nullptr) X_LC.linear() = DrawRollPitchYaw(random_);
    text_ += fmt::format("<link name=\"{}\">{}</link>\n", name, WriteInertial(own, X_LC));
  }

  void AddWeldedBody(size_t index) {
    Joint& joint = spec_.joints[index];
    MassProperties tool = joint.body;
    tool.mass *= 0.3;
    tool.com += Vector3d(0.05, -0.02, 0.03);
    tool.inertia *= 0.2;
    Pose X_LT = Pose::Identity();
    X_LT.linear() = DrawRollPitchYaw(random_);
    X_LT.translation() = Vector3d(0.1, 0.02, -0.04);
    AddBody(joint.link + "_tool", tool, own_frames_[index] * X_LT);
    AddJoint(joint.name + "_weld", "fixed", joint.link, joint.link + "_tool", X_LT, "");
    joint.body = Combine({joint.body, tool});
  }

  void AddFrame(const Frame& frame) {
    text_ += fmt::format("<link name=\"{}\"/>\n", frame.name);
    AddJoint(frame.name + "_fixed", "fixed", LinkName(frame.link), frame.name,
             OwnFrame(frame.link).inverse() * frame.X_LF, "");
  }

  RobotSpec& spec_;
  std::mt19937* random_;
  double dry_friction_;
  std::vector<Pose> own_frames_;
  std::string text_;
};

}  // namespace

std::string WriteUrdf(RobotSpec* spec, std::mt19937* random, double dry_friction) {
  return UrdfWriter(spec, random, dry_friction).Write();
}

}  // namespace dexcheck::testing
