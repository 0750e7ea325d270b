#include "harness/study/search_exchange.h"

#include <system_error>

#include "controller/common/errors.h"
#include "harness/base/partial_file.h"
#include "harness/engine/machine.h"

namespace dexcheck {

SearchExchange::SearchExchange(const StudyInputs& inputs, const SearchPart& part)
    : identity_(IdentifyStudy(inputs)), study_(inputs.study), part_(part), machine_(DescribeMachine()) {
  std::error_code error;
  std::filesystem::create_directories(part.exchange, error);
  if (!std::filesystem::is_directory(part.exchange))
    throw InputError(part.exchange.string() + ": cannot be made: " + error.message());
}

std::filesystem::path SearchExchange::FileOf(long part, long first) const {
  return part_.exchange / ("trials-from-" + std::to_string(first) + "-part-" + std::to_string(part + 1) +
                           "-of-" + std::to_string(part_.count) + ".sqlite");
}

void SearchExchange::Publish(long first, const std::vector<TrialRow>& rows) const {
  const std::filesystem::path target = FileOf(part_.index, first);
  if (rows.empty() || std::filesystem::exists(target)) return;
  PartialFile file(target);
  StudyStore::OpenOrCreate(file.partial(), identity_, study_).Add(rows);
  file.Commit();
}

std::vector<TrialRow> SearchExchange::Read(long first) {
  if (first != first_) read_.assign(static_cast<size_t>(part_.count), false);
  first_ = first;
  std::vector<TrialRow> rows;
  for (long part = 0; part < part_.count; ++part) {
    const std::filesystem::path source = FileOf(part, first);
    if (part == part_.index || read_[static_cast<size_t>(part)] || !std::filesystem::exists(source)) continue;
    // Never committed: it goes with this object.
    const PartialFile copy(FileOf(part_.index, first).string() + ".copy");
    std::filesystem::copy_file(source, copy.partial(), std::filesystem::copy_options::overwrite_existing);
    const StudyStore store = StudyStore::Open(copy.partial());
    try {
      store.RequireSame(identity_);
    } catch (const InputError&) {
      throw InputError(source.string() + ": is of another study or of another revision of dexcheck");
    }
    for (TrialRow& row : store.ReadRows()) {
      if (row.machine != machine_) {
        throw InputError(
            source.string() + ": was made on another kind of machine, \"" + row.machine + "\" and not \"" +
            machine_ + "\": trials of a search follow from one another bit for bit, take nodes of one kind");
      }
      rows.push_back(std::move(row));
    }
    read_[static_cast<size_t>(part)] = true;
  }
  return rows;
}

}  // namespace dexcheck
