#include "harness/study/study_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/study/process_name.h"
#include "harness/study/study_change.h"

namespace dexcheck {
namespace {

constexpr int kApplicationId = 0x44584353;  // "DXCS", tells a study from other databases
const std::string kLayout = kStudyLayout;
constexpr const char* kLayoutWithoutMachine = "1";  // does not say which machine made a trial

std::string QuoteName(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

StudyStore::StudyStore(const std::filesystem::path& path, Database::Mode mode)
    : database_(std::make_unique<Database>(path, mode)) {}

StudyStore StudyStore::OpenOrCreate(const std::filesystem::path& path, const StudyIdentity& identity,
                                    const Study& study, const MakesSameRows& makes_same_rows) {
  StudyStore store(path, Database::Mode::kCreate);
  store.Create(identity, study);
  store.Load();
  store.Adopt(identity, study, makes_same_rows);
  return store;
}

StudyStore StudyStore::Open(const std::filesystem::path& path) {
  StudyStore store(path, Database::Mode::kExisting);
  store.Load();
  return store;
}

void StudyStore::Create(const StudyIdentity& identity, const Study& study) {
  const auto is_empty = [&] {
    Statement count(database_.get(), "SELECT count(*) FROM sqlite_master");
    count.Step();
    return count.GetWhole(0) == 0;
  };
  if (!is_empty()) return;
  Transaction transaction(database_.get());
  if (!is_empty()) return;  // another process was faster
  database_->Execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  std::string columns;
  std::string marks;
  for (const auto& [column, value] : identity) {
    columns += (columns.empty() ? "" : ", ") + column + " TEXT NOT NULL";
    marks += marks.empty() ? "?" : ", ?";
  }
  database_->Execute("CREATE TABLE study (" + columns + ")");
  Statement insert(database_.get(), "INSERT INTO study VALUES (" + marks + ")");
  for (size_t i = 0; i < identity.size(); ++i) insert.Bind(static_cast<int>(i) + 1, identity[i].second);
  insert.Step();
  study_ = study;
  std::string table = "CREATE TABLE trials (trial INTEGER PRIMARY KEY, seed INTEGER NOT NULL";
  for (const Variation& variation : study.variations) {
    table += ", " + QuoteName(variation.key) + " REAL NOT NULL";
  }
  table += ", outcome TEXT NOT NULL, failure TEXT NOT NULL";
  for (const MetricInfo& metric : kMetrics) table += std::string(", ") + metric.name + " REAL";
  database_->Execute(table + ", machine TEXT NOT NULL)");
  // Of trials that are running: who has them.
  database_->Execute("CREATE TABLE claims (trial INTEGER PRIMARY KEY, process TEXT NOT NULL)");
  transaction.Commit();
}

void StudyStore::Load() {
  Statement id(database_.get(), "PRAGMA application_id");
  if (!id.Step() || id.GetWhole(0) != kApplicationId) {
    throw InputError(database_->name() + ": is not the database of a study");
  }
  Upgrade();
  AddMissingMetrics();
  identity_.clear();
  for (const char* column : {"layout", "name", "study", "scenario", "robot", "mjcf_hash", "dexcheck_version",
                             "git_revision", "mujoco_version"}) {
    Statement select(database_.get(), std::string("SELECT ") + column + " FROM study");
    select.Step();
    identity_.emplace_back(column, select.GetText(0));
  }
  study_ = ParseStudy(Identify("study"), database_->name());
}

void StudyStore::Upgrade() {
  const auto read_layout = [&] {
    Statement layout(database_.get(), "SELECT layout FROM study");
    return layout.Step() ? layout.GetText(0) : "";
  };
  if (read_layout() == kLayout) return;
  Transaction transaction(database_.get());
  if (read_layout() == kLayout) return;  // another process was faster
  if (read_layout() != kLayoutWithoutMachine) {
    throw InputError(database_->name() + ": was written by another version of dexcheck");
  }
  database_->Execute("ALTER TABLE trials ADD COLUMN machine TEXT NOT NULL DEFAULT ''");
  database_->Execute("UPDATE study SET layout = '" + kLayout + "'");
  transaction.Commit();
}

void StudyStore::AddMissingMetrics() {
  const auto list_missing = [&] {
    std::set<std::string> there;
    Statement columns(database_.get(), "SELECT name FROM pragma_table_info('trials')");
    while (columns.Step()) there.insert(columns.GetText(0));
    std::vector<std::string> missing;
    for (const MetricInfo& metric : kMetrics) {
      if (!there.contains(metric.name)) missing.emplace_back(metric.name);
    }
    return missing;
  };
  if (list_missing().empty()) return;
  Transaction transaction(database_.get());
  // Another process may have been faster.
  for (const std::string& name : list_missing()) {
    database_->Execute("ALTER TABLE trials ADD COLUMN " + name + " REAL");
  }
  transaction.Commit();
}

const std::string& StudyStore::Identify(const std::string& column) const {
  for (const auto& [name, value] : identity_) {
    if (name == column) return value;
  }
  throw InputError(database_->name() + ": no column " + Quote(column));
}

bool StudyStore::IsInUse() const {
  Statement claims(database_.get(), "SELECT process FROM claims");
  bool in_use = false;
  while (claims.Step()) in_use = in_use || IsRunningHere(claims.GetText(0));
  return in_use;
}

void StudyStore::Update(const std::string& column, const std::string& value) {
  Statement update(database_.get(), "UPDATE study SET " + column + " = ?");
  update.Bind(1, value);
  update.Step();
  for (auto& [name, text] : identity_) {
    if (name == column) text = value;
  }
}

void StudyStore::Adopt(const StudyIdentity& identity, const Study& study,
                       const MakesSameRows& makes_same_rows) {
  // The texts of study and program may be others; what they mean decides.
  StudyIdentity strict = identity;
  std::erase_if(strict, [&](const auto& column) {
    return column.first == "study" || (column.first == "name" && study.text != study_.text) ||
           (makes_same_rows && column.first == "git_revision");
  });
  RequireSame(strict);
  const auto find = [&](const std::string& column) {
    const auto found = std::find_if(identity.begin(), identity.end(),
                                    [&](const auto& entry) { return entry.first == column; });
    return found == identity.end() ? Identify(column) : found->second;
  };
  const std::string difference = FindDifference(study_, study);
  if (!difference.empty()) {
    throw InputError(database_->name() + ": is of another study: study differs: " + difference +
                     "; rows made otherwise cannot be kept, take another database");
  }
  if (find("git_revision") != Identify("git_revision")) {
    if (!makes_same_rows(ReadRows())) RequireSame(identity);  // which throws
    Update("git_revision", find("git_revision"));
    change_ = "its rows are of another revision, which made the same ones";
  }
  if (study.text == study_.text) return;
  if (!HasSameTrials(study_, study)) {
    if (IsInUse())
      throw InputError(database_->name() + ": another process makes trials of the study as it was");
    Transaction transaction(database_.get());
    StudyChange changed = ChangeStudy(study_, study, ReadRows(std::numeric_limits<long>::min()));
    database_->Execute("DELETE FROM trials");
    study_ = study;
    insert_.reset();  // their columns' order
    find_.reset();
    for (const TrialRow& row : changed.rows) Insert(row);
    Update("study", study.text);
    Update("name", study.name);
    transaction.Commit();
    change_ += (change_.empty() ? "" : "; ") + ("the study was edited: " + Describe(changed));
    return;
  }
  study_ = study;
  Update("study", study.text);
  Update("name", study.name);
}

void StudyStore::RequireSame(const StudyIdentity& other) const {
  constexpr size_t kReadable = 64;
  for (const auto& [column, value] : other) {
    const std::string& own = Identify(column);
    if (own == value) continue;
    if (column == "study") {
      const Study there = ParseStudy(value, database_->name());
      if (HasSameTrials(study_, there)) continue;
    }
    const bool is_short = own.size() < kReadable && value.size() < kReadable;
    throw InputError(database_->name() + ": is of another study: " + column + " differs" +
                     (is_short ? ", " + Quote(own) + " there and " + Quote(value) + " here" : ""));
  }
}

std::string StudyStore::ListColumns() const {
  std::string columns = "trial, seed";
  for (const Variation& variation : study_.variations) columns += ", " + QuoteName(variation.key);
  columns += ", outcome, failure";
  for (const MetricInfo& metric : kMetrics) columns += std::string(", ") + metric.name;
  return columns + ", machine";
}

std::vector<long> StudyStore::ListNumbers() const {
  Statement select(database_.get(), "SELECT trial FROM trials WHERE trial >= 0 ORDER BY trial");
  std::vector<long> numbers;
  while (select.Step()) numbers.push_back(static_cast<long>(select.GetWhole(0)));
  return numbers;
}

std::map<Outcome, long> StudyStore::CountOutcomes() const {
  Statement select(database_.get(), "SELECT outcome, count(*) FROM trials WHERE trial >= 0 GROUP BY outcome");
  std::map<Outcome, long> counts;
  while (select.Step()) {
    const auto outcome = FindOutcome(select.GetText(0));
    if (outcome) counts[*outcome] = static_cast<long>(select.GetWhole(1));
  }
  return counts;
}

std::vector<TrialRow> StudyStore::ReadRows(long first, bool with_machine) const {
  // A vector that grows holds its rows twice for a moment.
  Statement count(database_.get(), "SELECT count(*) FROM trials WHERE trial >= ?");
  count.Bind(1, static_cast<long long>(first));
  count.Step();
  std::vector<TrialRow> rows;
  rows.reserve(static_cast<size_t>(count.GetWhole(0)));
  ForEachRow([&](TrialRow&& row) { rows.push_back(std::move(row)); }, first, with_machine);
  return rows;
}

void StudyStore::ForEachRow(const std::function<void(TrialRow&&)>& take, long first,
                            bool with_machine) const {
  Statement select(database_.get(),
                   "SELECT " + ListColumns() + " FROM trials WHERE trial >= ? ORDER BY trial");
  select.Bind(1, static_cast<long long>(first));
  while (select.Step()) take(ReadRow(select, with_machine));
}

TrialRow StudyStore::ReadRow(const Statement& select, bool with_machine) const {
  TrialRow row;
  int column = 0;
  row.trial.number = static_cast<long>(select.GetWhole(column++));
  row.trial.seed = static_cast<std::uint64_t>(select.GetWhole(column++));
  row.trial.parameters.reserve(study_.variations.size());
  const auto reject = [&](const std::string& key, const std::string& why) {
    throw InputError(database_->name() + ": trial " + std::to_string(row.trial.number) + ": " + key + ": " +
                     why + ", got " + Quote(select.GetText(column)));
  };
  for (const Variation& variation : study_.variations) {
    const double value = select.GetNumber(column);
    if (!select.IsNumber(column)) reject(variation.key, "must be a number");
    // Of a key of texts the number of one of them.
    const auto count = static_cast<double>(variation.labels.size());
    if (count > 0.0 && !(value >= 0.0 && value < count && value == std::floor(value)))
      reject(variation.key, fmt::format("must be a whole number from 0 to {}", count - 1.0));
    row.trial.parameters.push_back(value);
    ++column;
  }
  const std::string outcome = select.GetText(column);
  if (!FindOutcome(outcome)) reject("outcome", "unknown");
  ++column;
  row.result.outcome = *FindOutcome(outcome);
  row.result.failure = select.GetText(column++);
  for (size_t i = 0; i < kMetrics.size(); ++i, ++column) {
    if (!select.IsNumber(column) && !select.IsNull(column)) reject(kMetrics[i].name, "must be a number");
    row.result.metrics[i] = select.GetNumber(column);
  }
  if (with_machine) row.machine = select.GetText(column);
  return row;
}

std::optional<TrialRow> StudyStore::FindRow(long trial) const {
  if (!find_) {
    find_ = std::make_unique<Statement>(database_.get(),
                                        "SELECT " + ListColumns() + " FROM trials WHERE trial = ?");
  }
  find_->Bind(1, static_cast<long long>(trial));
  std::optional<TrialRow> row;
  if (find_->Step()) row = ReadRow(*find_, /*with_machine=*/true);
  find_->Reset();
  return row;
}

bool StudyStore::Has(long trial) const {
  Statement select(database_.get(), "SELECT 1 FROM trials WHERE trial = ?");
  select.Bind(1, static_cast<long long>(trial));
  return select.Step();
}

std::vector<long> StudyStore::Claim(const std::vector<long>& trials) {
  Transaction transaction(database_.get());
  Statement owner(database_.get(), "SELECT process FROM claims WHERE trial = ?");
  Statement claim(database_.get(), "INSERT OR REPLACE INTO claims VALUES (?, ?)");
  const std::string self = NameThisProcess();
  std::vector<long> claimed;
  for (const long trial : trials) {
    if (Has(trial)) continue;
    owner.Bind(1, static_cast<long long>(trial));
    const bool taken = owner.Step() && IsRunningHere(owner.GetText(0));
    owner.Reset();
    if (taken) continue;
    claim.Bind(1, static_cast<long long>(trial));
    claim.Bind(2, self);
    claim.Step();
    claimed.push_back(trial);
  }
  transaction.Commit();
  return claimed;
}

void StudyStore::Release(const std::vector<long>& trials) {
  Statement release(database_.get(), "DELETE FROM claims WHERE trial = ? AND process = ?");
  release.Bind(2, NameThisProcess());
  for (const long trial : trials) {
    release.Bind(1, static_cast<long long>(trial));
    release.Step();
  }
}

void StudyStore::Insert(const TrialRow& row) {
  if (!insert_) {
    std::string marks = "?, ?, ?, ?, ?";
    for (size_t i = 0; i < study_.variations.size() + kNumMetrics; ++i) marks += ", ?";
    insert_ = std::make_unique<Statement>(
        database_.get(), "INSERT OR IGNORE INTO trials (" + ListColumns() + ") VALUES (" + marks + ")");
  }
  Statement& insert = *insert_;
  int parameter = 1;
  insert.Bind(parameter++, static_cast<long long>(row.trial.number));
  insert.Bind(parameter++, static_cast<long long>(row.trial.seed));
  for (const double value : row.trial.parameters) insert.Bind(parameter++, value);
  insert.Bind(parameter++, NameOf(row.result.outcome));
  insert.Bind(parameter++, row.result.failure);
  for (const double metric : row.result.metrics) insert.Bind(parameter++, metric);
  insert.Bind(parameter++, row.machine);
  insert.Step();
}

void StudyStore::Add(const std::vector<TrialRow>& rows) {
  Transaction transaction(database_.get());
  std::vector<long> numbers;
  for (const TrialRow& row : rows) {
    Insert(row);
    numbers.push_back(row.trial.number);
  }
  Release(numbers);
  transaction.Commit();
}

void StudyStore::Remove(long trial) {
  Statement remove(database_.get(), "DELETE FROM trials WHERE trial = ?");
  remove.Bind(1, static_cast<long long>(trial));
  remove.Step();
}

void StudyStore::AddAll(const std::vector<TrialSource>& sources) {
  Transaction transaction(database_.get());
  std::unordered_map<long, const std::string*> added;  // from which source
  for (const TrialSource& source : sources) {
    source.read([&](TrialRow&& row) {
      const long number = row.trial.number;
      if (const auto other = FindRow(number)) {
        if (IsFailed(row.result.outcome)) return;
        if (IsFailed(other->result.outcome)) {
          Remove(number);
        } else if (IsSame(*other, row)) {
          return;
        } else {
          const auto from = added.find(number);
          throw InputError(source.name + ": trial " + std::to_string(number) +
                           " has another result than in " +
                           (from == added.end() ? database_->name() : *from->second));
        }
      }
      Insert(row);
      added[number] = &source.name;
    });
  }
  transaction.Commit();
}

void StudyStore::RemoveFrom(long first) {
  Statement remove(database_.get(), "DELETE FROM trials WHERE trial >= ?");
  remove.Bind(1, static_cast<long long>(first));
  remove.Step();
}

long StudyStore::RemoveFailed(const std::vector<long>& trials) {
  Transaction transaction(database_.get());
  std::set<long> failed;
  for (const TrialRow& row : ReadRows()) {
    if (IsFailed(row.result.outcome)) failed.insert(row.trial.number);
  }
  long count = 0;
  for (const long trial : trials) {
    if (failed.count(trial) == 0) continue;
    Remove(trial);
    ++count;
  }
  transaction.Commit();
  return count;
}

}  // namespace dexcheck
