#include "harness/descriptions/program_provider.h"

#include "controller/common/text.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

OrderedJson ToList(const VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

OrderedJson MakeHello(const RobotDescription& robot, const ProgramLayout& layout) {
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

ProgramProvider::ProgramProvider(const std::string& command, const RobotDescription& robot,
                                 const ProgramOptions& options)
    : LayoutProvider(ProgramLayout(robot)),
      robot_(robot),
      process_(command, options.seconds),
      source_("program " + Quote(command)),
      name_(command) {
  const Json result = Query(MakeHello(robot, layout()));
  if (!result.contains("dexcheck_protocol") || result.at("dexcheck_protocol") != kProgramProtocol) {
    throw InputError(
        source_ + ": dexcheck_protocol: must be " + std::to_string(kProgramProtocol) + ", got " +
        (result.contains("dexcheck_protocol") ? Abbreviate(result.at("dexcheck_protocol").dump()) : "none"));
  }
  if (result.contains("name") && result.at("name").is_string()) {
    name_ = Abbreviate(result.at("name").get<std::string>());
  }
  set_layout(ProgramLayout(robot_, result, source_));
}

Json ProgramProvider::Query(const OrderedJson& request) {
  const std::string line =
      process_.Query(request.dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
  const std::optional<Json> parsed = ParseResult(line);
  if (!parsed) {
    throw InputError(source_ + ": must write a JSON object on one line (NaN and Infinity are none), got " +
                     Quote(line));
  }
  const Json& result = *parsed;
  if (result.contains("error")) {
    const Json& error = result.at("error");
    throw ProgramError(source_ +
                       ": says: " + Abbreviate(error.is_string() ? error.get<std::string>() : error.dump()));
  }
  return result;
}

TermResults ProgramProvider::Evaluate(long sample, const VectorXd& q, const VectorXd& xi) {
  const VectorXd positions = layout().WritePositions(q);
  const VectorXd velocities = layout().WriteVelocities(q, xi);
  const Json result =
      Query({{"request", "terms"}, {"id", sample}, {"q", ToList(positions)}, {"v", ToList(velocities)}});
  const std::string source = source_ + ": state " + std::to_string(sample);
  if (!result.contains("id") || result.at("id") != sample) {
    throw InputError(source + ": id: must be " + std::to_string(sample) + ", got " +
                     (result.contains("id") ? Abbreviate(result.at("id").dump()) : "none"));
  }
  TermResults terms = ReadResult(result, layout(), velocities, source);
  layout().ReadTerms(q, xi, &terms);
  return terms;
}

}  // namespace dexcheck
