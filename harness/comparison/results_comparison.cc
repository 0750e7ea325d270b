#include "harness/comparison/results_comparison.h"

#include <functional>
#include <memory>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/result_files.h"

namespace dexcheck {
namespace {

/// A description whose terms stand first: the analytic model's, or of an MJCF the engine's.
struct Reference {
  Reference(const DescriptionFile& file, Comparison* comparison) : robot(file.Describe()) {
    comparison->first = file.path();
    comparison->notes = robot.notes;
    comparison->model.emplace(robot.spec);
    if (file.format() == RobotFormat::kMjcf) {
      provider =
          std::make_unique<EngineProvider>(robot.spec, file.CopyEngine(), file.path().string(), "MuJoCo");
    } else {
      provider = std::make_unique<AnalyticProvider>(*comparison->model, file.path().filename().string());
    }
  }
  RobotDescription robot;
  std::unique_ptr<DynamicsProvider> provider;
};

/// Notes the convention of the base where the other side chose it.
void NoteConvention(const Reference& reference, LayoutProvider* provider,
                    const std::function<StateFeed()>& make_feed, Comparison* comparison) {
  if (!provider->layout().is_floating()) return;
  comparison->notes.push_back("the other side's base is taken as " +
                              Describe(provider->layout().convention()));
  if (comparison->result.Agrees()) return;
  const std::optional<BaseConvention> other =
      FindOtherConvention(*comparison->model, reference.provider.get(), provider, make_feed);
  if (!other) return;
  comparison->notes.push_back("all its terms agree with its base taken as " + Describe(*other) +
                              ": this is its convention, and its key \"base\" can say so");
}

}  // namespace

Comparison CompareResults(const std::filesystem::path& file, const ResultsSource& source,
                          const UrdfOptions& urdf, const ConsistencyOptions& options,
                          const Progress& progress) {
  Comparison comparison;
  const Reference reference(DescriptionFile(file, urdf), &comparison);
  std::unique_ptr<LayoutProvider> provider;
  std::function<StateFeed()> make_feed = [&] { return FeedRandomStates(*comparison.model, options); };
  if (source.results.empty()) {
    comparison.second = "the program";
    provider = std::make_unique<ProgramProvider>(source.program, reference.robot, source.program_options);
  } else {
    comparison.second = source.results;
    auto results = std::make_unique<ResultFiles>(source.results, reference.robot);
    make_feed = [&read = *results] {
      return [&read](DynamicsState* state) { return read.ReadState(state); };
    };
    provider = std::move(results);
  }
  for (const std::string& note : DescribeCoordinates(reference.robot)) comparison.notes.push_back(note);
  comparison.result =
      CompareProviders(*comparison.model, reference.provider.get(), provider.get(), make_feed(), progress);
  if (!comparison.result.not_compared.empty())
    comparison.not_compared.push_back("terms without results: " + JoinNames(comparison.result.not_compared));
  if (provider->is_reduced()) {
    comparison.notes.push_back(
        "joints that follow others have no coordinate there: compared are T^T M T and T^T of the "
        "forces, with xi = T xi_free");
  }
  NoteConvention(reference, provider.get(), make_feed, &comparison);
  return comparison;
}

Comparison CompareFunctions(const std::filesystem::path& file, const TermFunctions& functions,
                            const UrdfOptions& urdf, const ConsistencyOptions& options) {
  if (!functions.M && !functions.c && !functions.g && !functions.h && !functions.friction) {
    throw InputError(functions.name + ": must have one of M, c, g, h, friction");
  }
  Comparison comparison;
  const Reference reference(DescriptionFile(file, urdf), &comparison);
  comparison.second = functions.name;
  FunctionProvider provider(functions, comparison.model->num_velocities());
  comparison.result =
      CompareProviders(*comparison.model, reference.provider.get(), &provider,
                       FeedRandomStates(*comparison.model, options), [](long) { return true; });
  return comparison;
}

}  // namespace dexcheck
