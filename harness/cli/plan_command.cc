#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/contact/shapes.h"
#include "controller/grasp/contact_plan.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/robot_model.h"
#include "controller/object/euler_zyz.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/engine/clearance.h"
#include "harness/engine/engine.h"

namespace dexcheck::cli {
namespace {

/// The smallest distance of a class of pairs over the postures of a plan.
struct PlanClearance {
  double distance = std::numeric_limits<double>::infinity();  ///< m
  std::string bodies;                                         ///< Empty when there is no such pair.
};

using Clearances = std::array<PlanClearance, kPairClassCount>;

/// How far bodies that should not touch are apart in an MJCF's scene, with the hand open and closed
/// around the object. @param q, q_open positions q'. @throws InputError as LoadMjcf and Adapter.
Clearances FindPlanClearance(const RobotModel& model, const std::filesystem::path& mjcf, const Pose& X_Bo,
                             const VectorXd& q, const VectorXd& q_open) {
  const MjModelPtr engine = LoadMjcf(mjcf);
  const Adapter adapter(model, *engine, mjcf.string());
  const Solids solids = ListSolids(*engine);
  const std::vector<WatchedPair> pairs = ListWatchedPairs(*engine, adapter, solids, {}, mjcf.string());
  const MjDataPtr data = MakeData(*engine);
  if (const int body = adapter.object_body(); body >= 0 && engine->body_jntnum[body] == 1) {
    mjtNum* const place = data->qpos + engine->jnt_qposadr[engine->body_jntadr[body]];
    const Eigen::Quaterniond turn(X_Bo.linear());
    std::copy_n(X_Bo.translation().data(), 3, place);
    const double quaternion[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
    std::copy_n(quaternion, 4, place + 3);
  }
  Clearances smallest;
  for (const VectorXd* posture : {&q, &q_open}) {
    adapter.SetPositions(*posture, data->qpos);
    mj_kinematics(engine.get(), data.get());
    Clearance clearance(*engine, adapter, solids, pairs);
    clearance.Update({data->xpos, data->xmat}, 0.0);
    for (size_t i = 0; i < smallest.size(); ++i) {
      const Clearance::Nearest& nearest = clearance.nearest(static_cast<PairClass>(i));
      if (nearest.pair < 0 || nearest.distance >= smallest[i].distance) continue;
      smallest[i] = {nearest.distance, clearance.Describe(nearest.pair)};
    }
  }
  return smallest;
}

struct PlanRequest {
  std::filesystem::path robot = FindShippedFile("controller/parameters/assistant_robot.toml");
  std::vector<double> xyz;  // m
  std::vector<double> zyz_deg = {0, 0, 0};
  std::string hand = "right";
  std::string palm;                     // overrides `hand`
  std::vector<std::string> joints_deg;  // NAME=VALUE
  std::vector<std::string> arm_joints;
  std::vector<double> lift;     // m
  std::vector<double> hold_at;  // m
  std::vector<double> hemisphere;
  std::optional<double> support_height;  // m
  ContactPlanOptions options;
  std::string mjcf;  // empty: the shipped scene for the shipped robot
  std::string json_file;
};

[[noreturn]] void Fail(const std::string& option, const std::string& problem) {
  throw InputError(option + ": " + problem);
}

int FindJoint(const RobotModel& model, const std::string& option, const std::string& name) {
  const int joint = model.FindJoint(name);
  if (joint < 0) Fail(option, Quote(name) + " is no joint of the model");
  return joint;
}

/// The palm's frame and the fingertips that hang on its link.
Hand FindHand(const RobotModel& model, const PlanRequest& request) {
  const bool by_palm = !request.palm.empty();
  const std::string name = by_palm ? request.palm : request.hand == "right" ? "r_palm_frame" : "l_palm_frame";
  Hand hand;
  try {
    hand.palm_frame = model.FindFrame(name);
  } catch (const std::invalid_argument&) {
    Fail(by_palm ? "--palm" : "--hand", Quote(name) + " is no frame of the model");
  }
  const int palm = model.frames()[static_cast<size_t>(hand.palm_frame)].link;
  for (const int tip : model.fingertips()) {
    int joint = model.frames()[static_cast<size_t>(tip)].link;
    while (joint >= 0 && joint != palm) joint = model.joints()[static_cast<size_t>(joint)].parent;
    if (joint == palm) hand.fingertips.push_back(tip);
  }
  if (hand.fingertips.size() < 3) {
    Fail(by_palm ? "--palm" : "--hand", "the link of " + Quote(name) + " carries " +
                                            std::to_string(hand.fingertips.size()) +
                                            " fingertips, at least three are needed");
  }
  hand.arm_joints = ListArmJoints(model, hand.fingertips, hand.palm_frame);
  if (hand.arm_joints.empty()) Fail("--palm", "no joint moves " + Quote(name) + " alone");
  if (request.arm_joints.empty()) return hand;
  hand.arm_joints.clear();
  for (const std::string& joint : request.arm_joints) {
    hand.arm_joints.push_back(FindJoint(model, "--arm-joints", joint));
  }
  return hand;
}

/// Arm joints in the middle of their ranges, all others 0, but for what the command line says.
VectorXd MakeNominalPosture(const RobotModel& model, const Hand& hand, const PlanRequest& request) {
  VectorXd q = VectorXd::Zero(model.num_positions());
  for (const int index : hand.arm_joints) {
    const Joint& joint = model.joints()[static_cast<size_t>(index)];
    q[model.num_base_positions() + index] = 0.5 * (joint.lower + joint.upper);
  }
  for (const std::string& assignment : request.joints_deg) {
    const size_t equals = assignment.find('=');
    if (equals == std::string::npos) Fail("--joints-deg", "must be NAME=DEGREES, got " + Quote(assignment));
    const auto degrees = ParseNumber<double>(assignment.substr(equals + 1));
    if (!degrees || !std::isfinite(*degrees))
      Fail("--joints-deg", "must be NAME=DEGREES, got " + Quote(assignment));
    const int index = FindJoint(model, "--joints-deg", assignment.substr(0, equals));
    const Joint& joint = model.joints()[static_cast<size_t>(index)];
    const double position = DegToRad(*degrees);
    if (position < joint.lower || position > joint.upper) {
      Fail("--joints-deg", assignment + " is outside of the range from " +
                               FormatNumber(RadToDeg(joint.lower)) + " to " +
                               FormatNumber(RadToDeg(joint.upper)));
    }
    q[model.num_base_positions() + index] = position;
  }
  return q;
}

/// What a scenario's [grasp] says.
Json MakeGrasp(const RobotModel& model, const Hand& hand, const Surface& surface, const ContactPlan& plan,
               const PlanRequest& request) {
  Json grasp;
  for (const int tip : hand.fingertips) {
    grasp["fingertips"].push_back(model.frames()[static_cast<size_t>(tip)].name);
  }
  if (!request.hemisphere.empty()) grasp["hemisphere"] = request.hemisphere;
  grasp["frame"] = model.frames()[static_cast<size_t>(hand.palm_frame)].name;
  const Pose X_Po = plan.X_oP.inverse();  // object in the palm frame
  const Vector3d zyz = CalcAnyZyzAngles(X_Po.linear());
  grasp["xyz"] = ToList(X_Po.translation());
  grasp["zyz_deg"] = {RadToDeg(zyz[0]), RadToDeg(zyz[1]), RadToDeg(zyz[2])};
  for (const SurfacePoint& contact : plan.contacts) {
    const Vector2d angles = AnglesOfPoint(surface, contact);
    grasp["contacts_deg"].push_back({RadToDeg(angles.x()), RadToDeg(angles.y())});
  }
  grasp["joints_deg"] = Json::object();
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    const double position = plan.q[model.num_base_positions() + joint];
    if (position != 0.0) {
      grasp["joints_deg"][model.joints()[static_cast<size_t>(joint)].name] = RadToDeg(position);
    }
  }
  return grasp;
}

/// As TOML has it; numbers to a millionth of a degree or a micrometre, and 0 without a sign.
std::string ToToml(const Json& value) {
  if (value.is_number()) return FormatNumber(std::round(value.get<double>() * 1e6) / 1e6 + 0.0);
  if (value.is_string()) return Quote(value.get<std::string>());
  std::string entries;
  for (const auto& [name, entry] : value.items()) {
    entries += (entries.empty() ? "" : ", ") + (value.is_object() ? name + " = " : "") + ToToml(entry);
  }
  return value.is_object() ? "{ " + entries + " }" : "[" + entries + "]";
}

/// The smallest of all; without bodies when nothing is watched.
const PlanClearance& FindSmallest(const Clearances& clearances) {
  return *std::ranges::min_element(clearances, {}, &PlanClearance::distance);
}

void PrintText(const PlanRequest& request, const ContactPlan& plan, const Json& grasp,
               const Clearances& clearances, double seconds) {
  fmt::print("# {} contacts for the object at {} m, {} degrees (ZYZ); {} palm poses tried in {:.2f} s\n",
             plan.contacts.size(), FormatNumbers(request.xyz), FormatNumbers(request.zyz_deg),
             plan.palm_poses, seconds);
  fmt::print("# margin of force closure {:.3f} per newton of normal force, mu = {}\n", plan.margin,
             FormatNumber(request.options.mu));
  fmt::print("# every joint stays {:.3f} or more from the ends of its range\n", plan.joint_margin);
  if (const PlanClearance& nearest = FindSmallest(clearances); !nearest.bodies.empty()) {
    fmt::print("# nearest of what should not touch, hand open or closed: {}, {:.1f} mm {}\n", nearest.bodies,
               1e3 * std::abs(nearest.distance), nearest.distance < 0.0 ? "into each other" : "apart");
  }
  if (std::abs(std::sin(DegToRad(request.zyz_deg[1]))) < kMinSinBeta) {
    fmt::print("# ZYZ angles are singular at this pose: in [control], orientation = \"rotation\"\n");
  }
  fmt::print("[grasp]\n");
  for (const auto& [key, value] : grasp.items()) fmt::print("{} = {}\n", key, ToToml(value));
}

std::string ToText(const PlanRequest& request, const ContactPlan& plan, const Json& grasp,
                   const Clearances& clearances, double seconds) {
  Json json = {
      {"found", plan.found},      {"object_xyz", request.xyz},     {"object_zyz_deg", request.zyz_deg},
      {"mu", request.options.mu}, {"palm_poses", plan.palm_poses}, {"seconds", seconds}};
  if (plan.found && !request.mjcf.empty()) {
    json["clearance"] = Json::object();
    for (size_t i = 0; i < clearances.size(); ++i) {
      const PlanClearance& one = clearances[i];
      if (one.bodies.empty()) continue;
      json["clearance"][NameOf(static_cast<PairClass>(i))] = {{"smallest_m", one.distance},
                                                              {"bodies", one.bodies}};
    }
  }
  if (plan.found) {
    json["margin"] = plan.margin;
    json["joint_margin"] = plan.joint_margin;
    json["q"] = ToList(plan.q);
    json["q_open"] = ToList(plan.q_open);
    json["grasp"] = grasp;
  } else {
    json["problem"] = plan.problem;
  }
  return json.dump(2) + "\n";
}

/// The three numbers of an option. @throws InputError when one is not finite.
Vector3d ToVector3(const char* option, const std::vector<double>& values) {
  const Vector3d vector(values[0], values[1], values[2]);
  if (!vector.allFinite()) Fail(option, "must be finite, got " + FormatNumbers(values));
  return vector;
}

int Run(PlanRequest request) {
  const std::filesystem::path shipped = FindShippedFile("controller/parameters/assistant_robot.toml");
  if (request.mjcf.empty() && request.robot == shipped) {
    request.mjcf = FindShippedFile("mjcf/scene.xml").string();
  }
  const RobotModel model = ParseRobotModel(ReadBytes(request.robot), std::string(request.robot));
  RequireNoBalls(model, "in a plan, whose postures have one number for each joint");
  if (!model.object())
    throw InputError(request.robot.string() + ": object: is missing, and a plan holds one");
  std::unique_ptr<Surface> surface;
  try {
    surface = MakeSurface(model.object()->shape);
  } catch (const std::invalid_argument& error) {
    throw InputError(request.robot.string() + ": " + error.what());
  }
  Hand hand = FindHand(model, request);
  if (!request.hold_at.empty()) hand.hold_at = ToVector3("--hold-at", request.hold_at);
  const VectorXd nominal = MakeNominalPosture(model, hand, request);
  const double tip_radius = *model.frames()[static_cast<size_t>(hand.fingertips.front())].sphere_radius;
  request.options.half_length = CalcContactHalfLength(model.object()->shape, tip_radius);
  if (request.support_height) {
    request.options.support = SupportPlane{Vector3d::UnitZ(), *request.support_height};
  }
  if (!request.hemisphere.empty()) {
    const Vector3d pole = ToVector3("--hemisphere", request.hemisphere);
    if (!(pole.norm() > 0.0)) Fail("--hemisphere", "must be a direction");
    request.options.hemisphere = pole.normalized();
  }
  if (!request.lift.empty()) {
    request.options.reaches.emplace_back(request.lift[0], request.lift[1], request.lift[2]);
  }
  Vector6d X_o;
  X_o << ToVector3("--object-xyz", request.xyz), kPi / 180.0 * ToVector3("--object-zyz-deg", request.zyz_deg);
  ResultFile json(request.json_file);

  const auto start = std::chrono::steady_clock::now();
  const ContactPlan plan = PlanContacts(model, hand, *surface, CalcObjectPose(X_o), nominal, request.options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Json grasp;
  Clearances clearances;
  if (plan.found) {
    grasp = MakeGrasp(model, hand, *surface, plan, request);
    if (!request.mjcf.empty())
      clearances = FindPlanClearance(model, request.mjcf, CalcObjectPose(X_o), plan.q, plan.q_open);
  }
  json.Write([&] { return ToText(request, plan, grasp, clearances, seconds); });
  if (!plan.found) throw Error("no plan: " + plan.problem);
  if (!json.TakesStdout()) PrintText(request, plan, grasp, clearances, seconds);
  return FindSmallest(clearances).distance < 0.0 ? kDisagreement : kSuccess;
}

}  // namespace

void AddPlanCommand(Command app) {
  const auto request = std::make_shared<PlanRequest>();
  Command command = app.AddCommand("plan", "Choose where a hand should hold the object");
  command.AddFlag("--contacts", "Contact points, posture and margin, as a scenario's [grasp]").Required();
  command.AddOption("--object-xyz X Y Z", &request->xyz, "Position of the object in the world, m")
      .Takes(3)
      .Required();
  command
      .AddOption("--object-zyz-deg A B C", &request->zyz_deg,
                 "Orientation of the object, ZYZ angles (default 0 0 0)")
      .Takes(3);
  Option hand =
      command.AddOption("--hand right|left", &request->hand, "Hand of the assistant robot that holds")
          .OneOf({"right", "left"})
          .ShowDefault();
  command
      .AddOption("--palm FRAME", &request->palm,
                 "Frame of a palm, whose z points at what it takes; its fingertips are those on its link")
      .Excludes(hand);
  command.AddOption("--mu MU", &request->options.mu, "Friction coefficient that the plan counts on")
      .ShowDefault();
  command.AddOption("--support-height Z", &request->support_height,
                    "Height of the table that the object lies on, m: the hand comes from above");
  command
      .AddOption(
          "--hemisphere X Y Z", &request->hemisphere,
          "Fingertips are hemispheres around this direction of their frames: contacts within their rims")
      .Takes(3);
  command
      .AddOption(
          "--hold-at X Y Z", &request->hold_at,
          "Where in the palm's frame the object is held, m: the search begins there; before the fingers "
          "when not given")
      .Takes(3);
  command
      .AddOption("--lift X Y Z", &request->lift,
                 "Displacement, m, that the arm must be able to make while holding")
      .Takes(3);
  command
      .AddOption("--joint-margin MARGIN", &request->options.joint_margin,
                 "Least distance of joints from the ends of their ranges, rad or m")
      .ShowDefault();
  command.AddOption(
      "--joints-deg NAME=DEGREES", &request->joints_deg,
      "Posture to stay near to; arm joints are otherwise in the middle of their ranges, others 0");
  command.AddOption("--arm-joints NAME", &request->arm_joints,
                    "Joints that may move the palm (default: those that move no other fingertips)");
  command.AddOption("--robot FILE.toml", &request->robot,
                    "Parameter file (TOML) with fingertips and an object");
  command.AddOption(
      "--mjcf FILE.xml", &request->mjcf,
      "Scene in which the robot's bodies must be clear of each other, the object and what stands "
      "there (default: the shipped one for the shipped robot)");
  AddJsonOption(command, "the plan", &request->json_file);
  command.SetAction([=] {
    try {
      return Run(*request);
    } catch (const std::invalid_argument& error) {  // the planner itself judges the options' values
      throw InputError(error.what());
    }
  });
}

}  // namespace dexcheck::cli
