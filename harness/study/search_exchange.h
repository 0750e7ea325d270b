#pragma once

// How the parts of one search, on nodes that fraction a folder and nothing else, learn of each other's rows.

#include <filesystem>
#include <vector>

#include "harness/study/study_store.h"

namespace dexcheck {

/// One of several processes that make a search together, each with a database of its own.
struct SearchPart {
  long index = 0;  ///< From 0.
  long count = 1;
  std::filesystem::path exchange;  ///< Folder that all parts see; empty for one part.
  [[nodiscard]] bool is_mine(long trial) const { return trial % count == index; }
};

/// Each part puts its rows of a batch into one file, which gets its name when it is whole and is never
/// changed again; readers copy a file before they open it. So nothing is locked, and no database is written
/// by two processes.
class SearchExchange {
 public:
  /// Makes the folder. @throws InputError.
  SearchExchange(const StudyInputs& inputs, const SearchPart& part);

  /// This part's rows of the batch that begins with trial `first`; once, later calls do nothing.
  void Publish(long first, const std::vector<TrialRow>& rows) const;

  /// What other parts have published of the batch since the last call for it.
  /// @throws InputError when it is of another study, or of a machine whose rows have other bits.
  std::vector<TrialRow> Read(long first);

 private:
  [[nodiscard]] std::filesystem::path FileOf(long part, long first) const;

  StudyIdentity identity_;
  Study study_;
  SearchPart part_;
  std::string machine_;
  long first_ = -1;
  std::vector<bool> read_;  // parts of the batch at `first_`
};

}  // namespace dexcheck
