#include "harness/study/study_store.h"

#include <SQLiteCpp/Transaction.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <cmath>
#include <limits>
#include <unordered_map>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/engine.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck {
namespace {

constexpr int kApplicationId = 0x44584353;  // "DXCS", distinguishes a study from other databases
/// For reading too the file has to be written: what a killed process left half done must be undone.
constexpr int kExisting = SQLITE_OPEN_READWRITE;

/// Transactions that may write; undone unless committed.
constexpr auto kWrites = SQLite::TransactionBehavior::IMMEDIATE;

std::string QuoteName(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// A column of the table of trials.
struct StoredColumn {
  std::string name, type;
};

/// In their order; what a trial is, then what it came to.
std::vector<StoredColumn> ListColumns(const Study& study) {
  std::vector<StoredColumn> columns = {{"trial", "INTEGER PRIMARY KEY"}, {"seed", "INTEGER NOT NULL"}};
  for (const Variation& variation : study.variations)
    columns.push_back({QuoteName(variation.key), "REAL NOT NULL"});
  columns.insert(columns.end(), {{"outcome", "TEXT NOT NULL"}, {"failure", "TEXT NOT NULL"}});
  for (const MetricInfo& metric : kMetrics) columns.push_back({metric.name, "REAL"});
  columns.push_back({"machine", "TEXT NOT NULL"});
  return columns;
}

/// Each in this format, with commas.
std::string JoinColumns(const Study& study, const std::string& format) {
  std::vector<std::string> texts;
  for (const StoredColumn& column : ListColumns(study))
    texts.push_back(fmt::format(fmt::runtime(format), column.name, column.type));
  return fmt::format("{}", fmt::join(texts, ", "));
}

/// None when there is no such column.
const std::string* FindText(const StudyIdentity& identity, const std::string& column) {
  for (const auto& [name, value] : identity) {
    if (name == column) return &value;
  }
  return nullptr;
}

std::string HashMjcf(const std::filesystem::path& mjcf) {
  std::string all;
  for (const std::string& file : ListMjcfFiles(mjcf)) {
    all += file + "\n" + HashBytes(ReadBytes(mjcf.parent_path() / file, kMostData)) + "\n";
  }
  return HashBytes(all);
}

}  // namespace

StudyIdentity IdentifyStudy(const StudyInputs& inputs) {
  return {{"layout", kStudyLayout},
          {"name", inputs.study.name},
          {"study", inputs.study.text},
          {"scenario", inputs.scenario_text},
          {"robot", ReadBytes(inputs.robot.string())},
          {"mjcf_hash", HashMjcf(inputs.mjcf)},
          {"controller_hash", inputs.controller_hash},
          {"dexcheck_version", Version()},
          {"git_revision", kGitRevision},
          {"mujoco_version", mj_versionString()}};
}

StudyStore::StudyStore(const std::filesystem::path& path, int flags)
    : database_(std::make_unique<SqliteFile>(path.string(), flags)) {}

StudyStore StudyStore::OpenOrCreate(const std::filesystem::path& path, const StudyIdentity& identity,
                                    const Study& study, const MakesSameRows& makes_same_rows) {
  StudyStore store(path, kExisting | SQLITE_OPEN_CREATE);
  store.database_->Do([&] {
    store.Create(identity, study);
    store.Load();
    store.GoOn(identity, study, makes_same_rows);
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
  SQLite::Transaction transaction(*database_, kWrites);
  if (!is_empty()) return;  // another process was faster
  database_->exec("PRAGMA application_id = " + std::to_string(kApplicationId));
  std::vector<std::string> columns, texts;
  for (const auto& [column, value] : identity) {
    columns.push_back(column + " TEXT NOT NULL");
    texts.emplace_back("?");
  }
  database_->exec(fmt::format("CREATE TABLE study ({})", fmt::join(columns, ", ")));
  SQLite::Statement insert(*database_, fmt::format("INSERT INTO study VALUES ({})", fmt::join(texts, ", ")));
  for (size_t i = 0; i < identity.size(); ++i) insert.bind(static_cast<int>(i) + 1, identity[i].second);
  insert.exec();
  database_->exec("CREATE TABLE trials (" + JoinColumns(study, "{} {}") + ")");
  // A trial that is running belongs to a process.
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
  constexpr const char* kText = "TEXT NOT NULL DEFAULT ''";
  const auto list_missing = [&] {
    std::vector<std::string> missing;
    const auto add = [&](const char* table, const char* name, const char* type) {
      auto there = database_->Prepare("SELECT 1 FROM pragma_table_info(?) WHERE name = ?", table, name);
      if (!there.executeStep()) missing.push_back(fmt::format("{} ADD COLUMN {} {}", table, name, type));
    };
    for (const MetricInfo& metric : kMetrics) add("trials", metric.name, "REAL");
    add("trials", "machine", kText);
    add("study", "controller_hash", kText);
    return missing;
  };
  if (list_missing().empty()) return;
  SQLite::Transaction transaction(*database_, kWrites);
  // Another process may have been faster.
  for (const std::string& column : list_missing()) database_->exec("ALTER TABLE " + column);
  transaction.commit();
}

const std::string& StudyStore::Identify(const std::string& column) const {
  if (const std::string* const value = FindText(identity_, column)) return *value;
  throw InputError(name() + ": no column " + Quote(column));
}

void StudyStore::Update(const std::string& column, const std::string& value) {
  database_->Prepare("UPDATE study SET " + column + " = ?", value).exec();
  for (auto& [name, text] : identity_) {
    if (name == column) text = value;
  }
}

void StudyStore::GoOn(const StudyIdentity& identity, const Study& study,
                      const MakesSameRows& makes_same_rows) {
  StudyIdentity strict = identity;
  if (makes_same_rows)
    std::erase_if(strict, [](const auto& column) { return column.first == "git_revision"; });
  RequireSame(strict);
  const std::string* const revision = FindText(identity, "git_revision");
  if (revision != nullptr && *revision != Identify("git_revision")) {
    if (!makes_same_rows(ReadRows())) RequireSame(identity);  // which throws
    Update("git_revision", *revision);
    change_ = "its rows are of another revision, which made the same ones";
  }
  if (study.text == study_.text) return;
  study_ = study;
  Update("study", study.text);
  Update("name", study.name);
}

void StudyStore::RequireSame(const StudyIdentity& other) const {
  constexpr size_t kReadable = 64;
  const auto refuse = [&](const std::string& what) {
    throw InputError(name() + ": is of another study: " + what +
                     "; each study needs a database file of its own");
  };
  for (const auto& [column, value] : other) {
    const std::string& own = Identify(column);
    if (own == value || column == "name") continue;  // which the study's text has, too
    if (column == "study") {
      const std::string key = FindDifference(study_, ParseStudy(value, name()));
      if (!key.empty()) refuse("key " + key + " differs");
      continue;
    }
    const bool is_short = own.size() < kReadable && value.size() < kReadable;
    refuse(column + " differs" +
           (is_short ? ", " + Quote(own) + " there and " + Quote(value) + " here" : ""));
  }
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
    auto count = database_->Prepare("SELECT count(*) FROM trials WHERE trial >= ?", first);
    count.executeStep();
    rows.reserve(static_cast<size_t>(count.getColumn(0).getInt64()));
  });
  ForEachRow([&](TrialRow&& row) { rows.push_back(std::move(row)); }, first, with_machine);
  return rows;
}

void StudyStore::ForEachRow(const std::function<void(TrialRow&&)>& take, long first,
                            bool with_machine) const {
  database_->Do([&] {
    auto select = database_->Prepare(
        "SELECT " + JoinColumns(study_, "{}") + " FROM trials WHERE trial >= ? ORDER BY trial", first);
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
    // A key of texts has the number of one of them.
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
      find_ = std::make_unique<SQLite::Statement>(
          *database_, "SELECT " + JoinColumns(study_, "{}") + " FROM trials WHERE trial = ?");
    }
    find_->reset();
    find_->bind(1, trial);
    std::optional<TrialRow> row;
    if (find_->executeStep()) row = ReadRow(*find_, /*with_machine=*/true);
    find_->reset();
    return row;
  });
}

std::vector<long> StudyStore::Claim(const std::vector<long>& trials) {
  return database_->Do([&] {
    SQLite::Transaction transaction(*database_, kWrites);
    const std::string self = NameThisProcess();
    std::vector<long> claimed;
    for (const long trial : trials) {
      if (FindRow(trial)) continue;
      auto owner = database_->Prepare("SELECT process FROM claims WHERE trial = ?", trial);
      if (owner.executeStep() && IsRunningHere(owner.getColumn(0))) continue;
      database_->Prepare("INSERT OR REPLACE INTO claims VALUES (?, ?)", trial, self).exec();
      claimed.push_back(trial);
    }
    transaction.commit();
    return claimed;
  });
}

void StudyStore::Release(const std::vector<long>& trials) {
  database_->Do([&] {
    const std::string self = NameThisProcess();
    for (const long trial : trials)
      database_->Prepare("DELETE FROM claims WHERE trial = ? AND process = ?", trial, self).exec();
  });
}

void StudyStore::Insert(const TrialRow& row) {
  if (!insert_) {
    insert_ = std::make_unique<SQLite::Statement>(
        *database_, fmt::format("INSERT OR IGNORE INTO trials ({}) VALUES ({})", JoinColumns(study_, "{}"),
                                JoinColumns(study_, "?")));
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
    SQLite::Transaction transaction(*database_, kWrites);
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
    SQLite::Transaction transaction(*database_, kWrites);
    std::unordered_map<long, const std::string*> added;  // from which source
    for (const TrialSource& source : sources) {
      source.read([&](TrialRow&& row) {
        const long number = row.trial.number;
        if (const auto other = FindRow(number)) {
          const bool gives_way = IsFailed(other->result.outcome);
          if (IsFailed(row.result.outcome) || (!gives_way && IsSame(*other, row))) return;
          const auto from = added.find(number);
          if (!gives_way) {
            throw InputError(source.name + ": trial " + std::to_string(number) +
                             " has another result than in " + (from == added.end() ? name() : *from->second));
          }
          database_->exec("DELETE FROM trials WHERE trial = " + std::to_string(number));
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
    database_->exec(fmt::format("DELETE FROM trials WHERE trial >= 0 AND outcome IN ('{}', '{}')",
                                NameOf(Outcome::kCrashed), NameOf(Outcome::kTimedOut)));
  });
}

}  // namespace dexcheck
