#include "harness/study/study_store.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

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

constexpr int kApplicationId = 0x44584353;  // "DXCS", distinguishes a study from other databases
/// For reading too the file has to be written: what a killed process left half done must be undone.
constexpr int kExisting = SQLITE_OPEN_READWRITE;

std::string QuoteName(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string ListMarks(size_t count) {
  return fmt::format("{}", fmt::join(std::vector<const char*>(count, "?"), ", "));
}

}  // namespace

StudyStore::StudyStore(const std::filesystem::path& path, int flags)
    : database_(std::make_unique<SqliteFile>(path.string(), flags)) {}

StudyStore StudyStore::OpenOrCreate(const std::filesystem::path& path, const StudyIdentity& identity,
                                    const Study& study, const MakesSameRows& makes_same_rows) {
  StudyStore store(path, kExisting | SQLITE_OPEN_CREATE);
  store.database_->Do([&] {
    store.Create(identity, study);
    store.Load();
    store.Adopt(identity, study, makes_same_rows);
  });
  return store;
}

StudyStore StudyStore::Open(const std::filesystem::path& path) {
  StudyStore store(path, kExisting);
  store.database_->Do([&] { store.Load(); });
  return store;
}

void StudyStore::Create(const StudyIdentity& identity, const Study& study) {
  const auto is_empty = [&] {
    return database_->execAndGet("SELECT count(*) FROM sqlite_master").getInt() == 0;
  };
  if (!is_empty()) return;
  SqliteTransaction transaction(database_.get());
  if (!is_empty()) return;  // another process was faster
  database_->exec("PRAGMA application_id = " + std::to_string(kApplicationId));
  std::vector<std::string> columns;
  for (const auto& [column, value] : identity) columns.push_back(column + " TEXT NOT NULL");
  database_->exec(fmt::format("CREATE TABLE study ({})", fmt::join(columns, ", ")));
  SQLite::Statement insert(*database_, "INSERT INTO study VALUES (" + ListMarks(identity.size()) + ")");
  for (size_t i = 0; i < identity.size(); ++i) insert.bind(static_cast<int>(i) + 1, identity[i].second);
  insert.exec();
  std::string table = "CREATE TABLE trials (trial INTEGER PRIMARY KEY, seed INTEGER NOT NULL";
  for (const Variation& variation : study.variations) {
    table += ", " + QuoteName(variation.key) + " REAL NOT NULL";
  }
  table += ", outcome TEXT NOT NULL, failure TEXT NOT NULL";
  for (const MetricInfo& metric : kMetrics) table += std::string(", ") + metric.name + " REAL";
  database_->exec(table + ", machine TEXT NOT NULL)");
  // Of trials that are running: who has them.
  database_->exec("CREATE TABLE claims (trial INTEGER PRIMARY KEY, process TEXT NOT NULL)");
  transaction.commit();
}

void StudyStore::Load() {
  if (database_->execAndGet("PRAGMA application_id").getInt() != kApplicationId) {
    throw InputError(name() + ": is not the database of a study");
  }
  AddMissingColumns();
  identity_.clear();
  for (const char* column : {"layout", "name", "study", "scenario", "robot", "mjcf_hash", "controller_hash",
                             "dexcheck_version", "git_revision", "mujoco_version"}) {
    identity_.emplace_back(column,
                           database_->execAndGet(fmt::format("SELECT {} FROM study", column)).getString());
  }
  std::string& layout = identity_.front().second;
  if (layout != kStudyLayout && layout != "1")  // which does not say which machine made a trial
    throw InputError(name() + ": was written by another version of dexcheck");
  if (layout != kStudyLayout) Update("layout", kStudyLayout);
  study_ = ParseStudy(Identify("study"), name());
}

void StudyStore::AddMissingColumns() {
  const auto list_columns = [&](const char* table) {
    std::set<std::string> there;
    SQLite::Statement columns(*database_, fmt::format("SELECT name FROM pragma_table_info('{}')", table));
    while (columns.executeStep()) there.insert(columns.getColumn(0));
    return there;
  };
  const auto list_missing = [&] {
    const std::set<std::string> there = list_columns("trials");
    std::vector<std::string> missing;
    for (const MetricInfo& metric : kMetrics) {
      if (!there.contains(metric.name))
        missing.push_back("trials ADD COLUMN " + std::string(metric.name) + " REAL");
    }
    if (!there.contains("machine"))
      missing.emplace_back("trials ADD COLUMN machine TEXT NOT NULL DEFAULT ''");
    if (!list_columns("study").contains("controller_hash"))
      missing.emplace_back("study ADD COLUMN controller_hash TEXT NOT NULL DEFAULT ''");
    return missing;
  };
  if (list_missing().empty()) return;
  SqliteTransaction transaction(database_.get());
  // Another process may have been faster.
  for (const std::string& column : list_missing()) database_->exec("ALTER TABLE " + column);
  transaction.commit();
}

const std::string& StudyStore::Identify(const std::string& column) const {
  for (const auto& [name, value] : identity_) {
    if (name == column) return value;
  }
  throw InputError(name() + ": no column " + Quote(column));
}

bool StudyStore::IsInUse() {
  SQLite::Statement claims(*database_, "SELECT process FROM claims");
  while (claims.executeStep()) {
    if (IsRunningHere(claims.getColumn(0))) return true;
  }
  return false;
}

void StudyStore::Update(const std::string& column, const std::string& value) {
  SQLite::Statement update(*database_, "UPDATE study SET " + column + " = ?");
  update.bind(1, value);
  update.exec();
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
    throw InputError(name() + ": is of another study: study differs: " + difference +
                     "; rows made otherwise cannot be kept, take another database");
  }
  if (find("git_revision") != Identify("git_revision")) {
    if (!makes_same_rows(ReadRows())) RequireSame(identity);  // which throws
    Update("git_revision", find("git_revision"));
    change_ = "its rows are of another revision, which made the same ones";
  }
  if (study.text == study_.text) return;
  if (!HasSameTrials(study_, study)) {
    if (IsInUse()) throw InputError(name() + ": another process makes trials of the study as it was");
    SqliteTransaction transaction(database_.get());
    StudyChange changed = ChangeStudy(study_, study, ReadRows(std::numeric_limits<long>::min()));
    database_->exec("DELETE FROM trials");
    study_ = study;
    insert_.reset();  // their columns' order
    find_.reset();
    for (const TrialRow& row : changed.rows) Insert(row);
    Update("study", study.text);
    Update("name", study.name);
    transaction.commit();
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
      const Study there = ParseStudy(value, name());
      if (HasSameTrials(study_, there)) continue;
    }
    const bool is_short = own.size() < kReadable && value.size() < kReadable;
    throw InputError(name() + ": is of another study: " + column + " differs" +
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
  return database_->Do([&] {
    SQLite::Statement select(*database_, "SELECT trial FROM trials WHERE trial >= 0 ORDER BY trial");
    std::vector<long> numbers;
    while (select.executeStep()) numbers.push_back(select.getColumn(0));
    return numbers;
  });
}

std::map<Outcome, long> StudyStore::CountOutcomes() const {
  return database_->Do([&] {
    SQLite::Statement select(*database_,
                             "SELECT outcome, count(*) FROM trials WHERE trial >= 0 GROUP BY outcome");
    std::map<Outcome, long> counts;
    while (select.executeStep()) {
      const auto outcome = FindOutcome(select.getColumn(0).getString());
      if (outcome) counts[*outcome] = select.getColumn(1);
    }
    return counts;
  });
}

std::vector<TrialRow> StudyStore::ReadRows(long first, bool with_machine) const {
  std::vector<TrialRow> rows;
  database_->Do([&] {
    // A vector that grows holds its rows twice for a moment.
    SQLite::Statement count(*database_, "SELECT count(*) FROM trials WHERE trial >= ?");
    count.bind(1, first);
    count.executeStep();
    rows.reserve(static_cast<size_t>(count.getColumn(0).getInt64()));
  });
  ForEachRow([&](TrialRow&& row) { rows.push_back(std::move(row)); }, first, with_machine);
  return rows;
}

void StudyStore::ForEachRow(const std::function<void(TrialRow&&)>& take, long first,
                            bool with_machine) const {
  database_->Do([&] {
    SQLite::Statement select(*database_,
                             "SELECT " + ListColumns() + " FROM trials WHERE trial >= ? ORDER BY trial");
    select.bind(1, first);
    while (select.executeStep()) take(ReadRow(select, with_machine));
  });
}

TrialRow StudyStore::ReadRow(const SQLite::Statement& select, bool with_machine) const {
  TrialRow row;
  int column = 0;
  row.trial.number = select.getColumn(column++);
  row.trial.seed = static_cast<std::uint64_t>(select.getColumn(column++).getInt64());
  row.trial.parameters.reserve(study_.variations.size());
  const auto reject = [&](const std::string& key, const std::string& why) {
    throw InputError(name() + ": trial " + std::to_string(row.trial.number) + ": " + key + ": " + why +
                     ", got " + Quote(select.getColumn(column).getString()));
  };
  const auto is_number = [](const SQLite::Column& value) { return value.isInteger() || value.isFloat(); };
  for (const Variation& variation : study_.variations) {
    const SQLite::Column value = select.getColumn(column);
    if (!is_number(value)) reject(variation.key, "must be a number");
    row.trial.parameters.push_back(value);
    // Of a key of texts the number of one of them.
    const auto count = static_cast<double>(variation.labels.size());
    const double number = row.trial.parameters.back();
    if (count > 0.0 && !(number >= 0.0 && number < count && number == std::floor(number)))
      reject(variation.key, fmt::format("must be a whole number from 0 to {}", count - 1.0));
    ++column;
  }
  const auto outcome = FindOutcome(select.getColumn(column).getString());
  if (!outcome) reject("outcome", "unknown");
  row.result.outcome = *outcome;
  row.result.failure = select.getColumn(++column).getString();
  for (size_t i = 0; i < kMetrics.size(); ++i) {
    const SQLite::Column value = select.getColumn(++column);
    if (!is_number(value) && !value.isNull()) reject(kMetrics[i].name, "must be a number");
    row.result.metrics[i] = value.isNull() ? std::numeric_limits<double>::quiet_NaN() : value.getDouble();
  }
  if (with_machine) row.machine = select.getColumn(++column).getString();
  return row;
}

std::optional<TrialRow> StudyStore::FindRow(long trial) const {
  return database_->Do([&] {
    if (!find_) {
      find_ = std::make_unique<SQLite::Statement>(*database_,
                                                  "SELECT " + ListColumns() + " FROM trials WHERE trial = ?");
    }
    find_->reset();
    find_->bind(1, trial);
    std::optional<TrialRow> row;
    if (find_->executeStep()) row = ReadRow(*find_, /*with_machine=*/true);
    find_->reset();
    return row;
  });
}

bool StudyStore::Has(long trial) const {
  return database_->Do([&] {
    SQLite::Statement select(*database_, "SELECT 1 FROM trials WHERE trial = ?");
    select.bind(1, trial);
    return select.executeStep();
  });
}

std::vector<long> StudyStore::Claim(const std::vector<long>& trials) {
  return database_->Do([&] {
    SqliteTransaction transaction(database_.get());
    SQLite::Statement owner(*database_, "SELECT process FROM claims WHERE trial = ?");
    SQLite::Statement claim(*database_, "INSERT OR REPLACE INTO claims VALUES (?, ?)");
    const std::string self = NameThisProcess();
    std::vector<long> claimed;
    for (const long trial : trials) {
      if (Has(trial)) continue;
      owner.reset();
      owner.bind(1, trial);
      if (owner.executeStep() && IsRunningHere(owner.getColumn(0))) continue;
      claim.reset();
      claim.bind(1, trial);
      claim.bind(2, self);
      claim.exec();
      claimed.push_back(trial);
    }
    owner.reset();
    transaction.commit();
    return claimed;
  });
}

void StudyStore::Release(const std::vector<long>& trials) {
  database_->Do([&] {
    SQLite::Statement release(*database_, "DELETE FROM claims WHERE trial = ? AND process = ?");
    release.bind(2, NameThisProcess());
    for (const long trial : trials) {
      release.reset();
      release.bind(1, trial);
      release.exec();
    }
  });
}

void StudyStore::Insert(const TrialRow& row) {
  if (!insert_) {
    const std::string marks = ListMarks(study_.variations.size() + kNumMetrics + 5);
    insert_ = std::make_unique<SQLite::Statement>(
        *database_, "INSERT OR IGNORE INTO trials (" + ListColumns() + ") VALUES (" + marks + ")");
  }
  SQLite::Statement& insert = *insert_;
  int parameter = 1;
  insert.bind(parameter++, row.trial.number);
  insert.bind(parameter++, static_cast<std::int64_t>(row.trial.seed));
  for (const double value : row.trial.parameters) insert.bind(parameter++, value);
  insert.bind(parameter++, NameOf(row.result.outcome));
  insert.bind(parameter++, row.result.failure);
  for (const double metric : row.result.metrics) insert.bind(parameter++, metric);  // NaN is NULL
  insert.bind(parameter++, row.machine);
  insert.exec();
  insert.reset();
}

void StudyStore::Add(const std::vector<TrialRow>& rows) {
  database_->Do([&] {
    SqliteTransaction transaction(database_.get());
    std::vector<long> numbers;
    for (const TrialRow& row : rows) {
      Insert(row);
      numbers.push_back(row.trial.number);
    }
    Release(numbers);
    transaction.commit();
  });
}

void StudyStore::AddAll(const std::vector<TrialSource>& sources) {
  database_->Do([&] {
    SqliteTransaction transaction(database_.get());
    std::unordered_map<long, const std::string*> added;  // from which source
    for (const TrialSource& source : sources) {
      source.read([&](TrialRow&& row) {
        const long number = row.trial.number;
        if (const auto other = FindRow(number)) {
          if (IsFailed(row.result.outcome)) return;
          if (IsFailed(other->result.outcome)) {
            database_->exec("DELETE FROM trials WHERE trial = " + std::to_string(number));
          } else if (IsSame(*other, row)) {
            return;
          } else {
            const auto from = added.find(number);
            throw InputError(source.name + ": trial " + std::to_string(number) +
                             " has another result than in " + (from == added.end() ? name() : *from->second));
          }
        }
        Insert(row);
        added[number] = &source.name;
      });
    }
    transaction.commit();
  });
}

void StudyStore::RemoveFrom(long first) {
  database_->Do([&] { database_->exec("DELETE FROM trials WHERE trial >= " + std::to_string(first)); });
}

void StudyStore::RemoveFailed() {
  database_->Do([&] {
    SQLite::Statement remove(*database_, "DELETE FROM trials WHERE trial >= 0 AND outcome IN (?, ?)");
    remove.bind(1, NameOf(Outcome::kCrashed));
    remove.bind(2, NameOf(Outcome::kTimedOut));
    remove.exec();
  });
}

}  // namespace dexcheck
