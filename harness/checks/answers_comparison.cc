#include "harness/checks/answers_comparison.h"

#include <filesystem>

#include "controller/common/errors.h"
#include "harness/descriptions/join_names.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/robot_file.h"

namespace dexcheck {

std::unique_ptr<TermSide> MakeReferenceSide(const RobotDescription& robot, const std::string& path) {
  if (FindFormat(std::filesystem::path(path)) == RobotFormat::kMjcf) {
    return std::make_unique<EngineSide>(robot, LoadMjcf(path), path, "MuJoCo");
  }
  return std::make_unique<AnalyticSide>(robot, std::filesystem::path(path).filename().string());
}

ConsistencyResult CompareAnswers(const RobotDescription& robot, TermSide* reference, AnsweringSide* side,
                                 const std::function<StateFeed()>& make_feed,
                                 const std::function<bool(long)>& progress, std::vector<std::string>* notes,
                                 std::vector<std::string>* not_compared) {
  ConsistencyResult result;
  SideComparison comparison(robot, {reference, side});
  result.samples = CompareAtStates(make_feed(), progress, &comparison);
  result.terms = comparison.TakePairs().front().terms;
  const std::vector<std::string> unanswered = comparison.ListUnanswered();
  if (!unanswered.empty()) not_compared->push_back("terms that are not answered: " + JoinNames(unanswered));
  if (side->is_reduced()) {
    notes->push_back(
        "joints that follow others have no coordinate there: compared are T^T M T and T^T of the "
        "forces, with xi = T xi_free");
  }
  if (!side->layout().is_floating()) return result;
  const BaseConvention spoken = side->layout().convention();
  notes->push_back("the other side's base is taken as " + Describe(spoken));
  if (result.Agrees()) return result;
  const std::optional<BaseConvention> other = FindOtherConvention(
      robot, reference, side, spoken,
      [side](const BaseConvention& convention) { side->set_convention(convention); }, make_feed);
  if (other) {
    notes->push_back("all its terms agree with its base taken as " + Describe(*other) +
                     ": this is its convention, and its key \"base\" can say so");
  }
  return result;
}

Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options) {
  if (!functions.M && !functions.c && !functions.g && !functions.h && !functions.friction) {
    throw InputError(functions.name + ": must have one of M, c, g, h, friction");
  }
  const RobotDescription robot = ReadDescription(file, urdf);
  Comparison comparison;
  comparison.first = file;
  comparison.second = functions.name;
  comparison.model.emplace(robot.spec);
  comparison.notes = robot.notes;
  const std::unique_ptr<TermSide> reference = MakeReferenceSide(robot, file.string());
  FunctionSide side(functions, comparison.model->num_velocities());
  SideComparison terms(robot, {reference.get(), &side});
  comparison.result.samples = CompareAtStates(
      FeedRandomStates(*comparison.model, options), [](long) { return true; }, &terms);
  comparison.result.terms = terms.TakePairs().front().terms;
  return comparison;
}

}  // namespace dexcheck
