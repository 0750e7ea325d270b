#pragma once

// How far a study has come, while it runs or after.

#include <string>

#include "harness/study/study_store.h"

namespace dexcheck {

struct StudyProgress {
  long done = 0;
  long total = 0;        ///< Of a search at most.
  bool is_over = false;  ///< Nothing is left to be made.
  std::string text;      ///< Lines: how far, outcomes, what is found so far.
};

StudyProgress FindProgress(const StudyStore& store);

}  // namespace dexcheck
