#include "harness/comparison/consistency.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "controller/common/errors.h"
#include "harness/base/worst.h"
#include "harness/comparison/engine_constants.h"
#include "harness/descriptions/engine_provider.h"

namespace dexcheck {

namespace {

/// Compares at all states; constants are the caller's.
ConsistencyResult CompareAll(const StateFeed& feed, const Progress& progress, TermComparison* comparison) {
  const auto start = std::chrono::steady_clock::now();
  ConsistencyResult result;
  result.samples = CompareAtStates(feed, progress, comparison);
  result.terms = comparison->TakePairs().front().terms;
  result.not_compared = comparison->ListNotCompared();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

bool ConsistencyResult::Agrees() const {
  const auto good = [](const CheckRecord& record) { return !record.failed; };
  return std::ranges::all_of(constants.records, good) && std::ranges::all_of(terms, good);
}

ConsistencyResult CompareTerms(const RobotModel& model, DynamicsProvider* first, DynamicsProvider* second,
                               const ConsistencyOptions& options, const Progress& progress) {
  TermComparison comparison(model, kAskedByConsistency, {first, second});
  return CompareAll(FeedRandomStates(model, options.samples, options.range, options.seed,
                                     comparison.needs_second_velocity(), model.object().has_value()),
                    progress, &comparison);
}

ConsistencyResult CheckConsistency(const Adapter& adapter, const ConsistencyOptions& options,
                                   const Progress& progress) {
  AnalyticProvider model(adapter.model(), "model", options.make_view, options.object);
  EngineProvider engine(adapter, "engine");
  ConsistencyResult result = CompareTerms(adapter.model(), &model, &engine, options, progress);
  result.constants = CheckConstants(adapter);
  return result;
}

ConsistencyResult CompareProviders(const RobotModel& model, DynamicsProvider* first, DynamicsProvider* second,
                                   const StateFeed& feed, const Progress& progress) {
  TermComparison comparison(model, kAskedOfPrograms, {first, second});
  return CompareAll(feed, progress, &comparison);
}

bool AgreeAtFirst(const RobotModel& model, DynamicsProvider* a, DynamicsProvider* b, const StateFeed& feed,
                  double tolerance) {
  constexpr long kStates = 3;
  const ConsistencyResult result =
      CompareProviders(model, a, b, feed, [](long samples) { return samples < kStates; });
  return !result.terms.empty() && std::ranges::all_of(result.terms, [&](const CheckRecord& record) {
    return record.worst <= Worst(record.bound, tolerance);
  });
}

std::optional<BaseConvention> FindOtherConvention(const RobotModel& model, DynamicsProvider* reference,
                                                  LayoutProvider* provider,
                                                  const std::function<StateFeed()>& make_feed) {
  const BaseConvention spoken = provider->layout().convention();
  std::optional<BaseConvention> found;
  for (const BaseConvention& convention : ListBaseConventions()) {
    if (convention == spoken || found) continue;
    provider->set_convention(convention);
    try {
      if (AgreeAtFirst(model, reference, provider, make_feed())) found = convention;
    } catch (const Error&) {
      break;  // a program may not bear what it did not request
    }
  }
  provider->set_convention(spoken);
  return found;
}

int CountDigits(double error) {
  constexpr int kMostDigits = 16;
  for (int digits = kMostDigits; digits > 0; --digits) {
    if (error <= std::pow(10.0, -digits)) return digits;
  }
  return 0;
}

}  // namespace dexcheck
