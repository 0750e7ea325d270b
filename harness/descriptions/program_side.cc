#include "harness/descriptions/program_side.h"

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

OrderedJson ToList(const VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

OrderedJson MakeHello(const RobotDescription& robot, const SideLayout& layout) {
  OrderedJson joints = OrderedJson::array();
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    joints.push_back({{"name", joint.name}, {"type", NameOf(joint.type)}});
    if (!robot.spec.joints[i].coupling) continue;
    joints.back()["follows"] =
        robot.spec.joints[static_cast<size_t>(robot.spec.joints[i].coupling->leader)].name;
    joints.back()["multiplier"] = robot.spec.joints[i].coupling->multiplier;
    joints.back()["offset"] = robot.spec.joints[i].coupling->offset;
  }
  const auto& g = robot.spec.gravity;
  return {{"dexcheck_protocol", kProgramProtocol},
          {"request", "hello"},
          {"robot",
           {{"name", robot.spec.name},
            {"source", robot.spec.source},
            {"gravity", {g[0], g[1], g[2]}},
            {"base", layout.is_floating() ? "floating" : "fixed"},
            {"joints", joints}}},
          {"layout", layout.ToJson()}};
}

}  // namespace

ProgramSide::ProgramSide(const std::string& command, const RobotDescription& robot,
                         const ProgramOptions& options)
    : AnsweringSide(SideLayout(robot)),
      robot_(robot),
      process_(command, options.seconds),
      source_("program " + Quote(command)),
      name_(command) {
  const Json answer = Ask(MakeHello(robot, layout()));
  if (!answer.contains("dexcheck_protocol") || answer.at("dexcheck_protocol") != kProgramProtocol) {
    throw InputError(
        source_ + ": dexcheck_protocol: must be " + std::to_string(kProgramProtocol) + ", got " +
        (answer.contains("dexcheck_protocol") ? Abbreviate(answer.at("dexcheck_protocol").dump()) : "none"));
  }
  if (answer.contains("name") && answer.at("name").is_string()) {
    name_ = Abbreviate(answer.at("name").get<std::string>());
  }
  set_layout(SideLayout(robot_, answer, source_));
}

Json ProgramSide::Ask(const OrderedJson& request) {
  const std::string line = process_.Ask(request.dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
  const std::optional<Json> parsed = ParseAnswer(line);
  if (!parsed) {
    throw InputError(source_ +
                     ": must answer with a JSON object on one line (NaN and Infinity are none), got " +
                     Quote(line));
  }
  const Json& answer = *parsed;
  if (answer.contains("error")) {
    const Json& error = answer.at("error");
    throw ProgramError(source_ +
                       ": says: " + Abbreviate(error.is_string() ? error.get<std::string>() : error.dump()));
  }
  return answer;
}

SideTerms ProgramSide::Evaluate(long sample, const VectorXd& q, const VectorXd& xi) {
  const VectorXd positions = layout().WritePositions(q);
  const VectorXd velocities = layout().WriteVelocities(q, xi);
  const Json answer =
      Ask({{"request", "terms"}, {"id", sample}, {"q", ToList(positions)}, {"v", ToList(velocities)}});
  const std::string source = source_ + ": state " + std::to_string(sample);
  if (!answer.contains("id") || answer.at("id") != sample) {
    throw InputError(source + ": id: must be " + std::to_string(sample) + ", got " +
                     (answer.contains("id") ? Abbreviate(answer.at("id").dump()) : "none"));
  }
  SideTerms terms = ReadSideTerms(answer, layout(), velocities, source);
  layout().ReadTerms(q, xi, &terms);
  return terms;
}

}  // namespace dexcheck
