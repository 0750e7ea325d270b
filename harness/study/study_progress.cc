#include "harness/study/study_progress.h"

#include <fmt/format.h>

#include "harness/study/search_history.h"
#include "harness/study/study_answer.h"

namespace dexcheck {

StudyProgress FindProgress(const StudyStore& store) {
  const Study& study = store.study();
  StudyProgress progress;
  progress.total = CountTrials(study);
  std::string outcomes;
  for (const auto& [outcome, count] : store.CountOutcomes()) {
    progress.done += count;
    outcomes += fmt::format("  {:<18}{:>7}\n", NameOf(outcome), count);
  }
  progress.text = fmt::format("{}: {} of {}{} trials in {}\n", study.name, progress.done,
                              study.is_search() ? "at most " : "", progress.total, store.name()) +
                  outcomes;
  progress.is_over = progress.done >= progress.total;
  const bool has_question = study.is_search() || !study.objectives.empty() || !study.constraints.empty() ||
                            study.sample.method == SamplingMethod::kSaltelli ||
                            study.sample.method == SamplingMethod::kMorris;
  if (!has_question) return progress;
  const std::vector<TrialRow> rows = store.ReadRows(0, /*with_machine=*/false);
  for (const std::string& answer : AnswerStudy(study, rows)) progress.text += answer + "\n";
  if (study.is_search()) {
    SearchHistory history(study, FindSearchStart(study));
    for (const TrialRow& row : rows) history.Add(row);
    progress.is_over = history.is_over();
  }
  return progress;
}

}  // namespace dexcheck
