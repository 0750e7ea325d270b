#include "harness/study/study_store.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/files.h"
#include "harness/base/version.h"
#include "harness/engine/engine.h"
#include "harness/engine/machine.h"
#include "harness/engine/mjcf_files.h"
#include "harness/study/git_revision.h"
#include "harness/study/process_name.h"

namespace dexcheck {
namespace {

constexpr int kApplicationId = 0x44584353;  // "DXCS", tells a study from other databases
constexpr const char* kLayout = "2";
constexpr const char* kLayoutWithoutMachine = "1";  // does not say which machine made a trial

/// FNV-1a, 64 bits.
std::string Hash(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  constexpr const char* kDigits = "0123456789abcdef";
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += kDigits[(hash >> shift) & 15U];
  return digits;
}

std::string HashMjcf(const std::filesystem::path& mjcf) {
  std::string all;
  for (const std::string& file : ListMjcfFiles(mjcf)) {
    all += file + "\n" + Hash(ReadBytes(mjcf.parent_path() / file)) + "\n";
  }
  return Hash(all);
}

std::string QuoteName(const std::string& name) {
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

bool IsSameNumber(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) ||
         std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

bool IsSame(const TrialRow& a, const TrialRow& b) {
  if (a.trial.seed != b.trial.seed || a.trial.parameters != b.trial.parameters ||
      a.result.outcome != b.result.outcome) {
    return false;
  }
  const bool exactly = a.machine == b.machine;
  if (exactly && a.result.failure != b.result.failure) return false;
  if (!exactly && !a.result.failure.empty() && !b.result.failure.empty()) return true;
  for (size_t i = 0; i < a.result.metrics.size(); ++i) {
    const double x = a.result.metrics[i];
    const double y = b.result.metrics[i];
    if (exactly ? !IsSameNumber(x, y)
                : !IsSameWithin(kMetricTolerance, x, y, std::max(std::abs(x), std::abs(y)))) {
      return false;
    }
  }
  return a.result.failure == b.result.failure;
}

StudyIdentity IdentifyStudy(const StudyInputs& inputs) {
  return {{"layout", kLayout},
          {"name", inputs.study.name},
          {"study", inputs.study.text},
          {"scenario", inputs.scenario_text},
          {"robot", ReadTextFile(inputs.robot.string())},
          {"mjcf_hash", HashMjcf(inputs.mjcf)},
          {"dexcheck_version", Version()},
          {"git_revision", kGitRevision},
          {"mujoco_version", mj_versionString()}};
}

StudyStore::StudyStore(const std::filesystem::path& path, Database::Mode mode)
    : database_(std::make_unique<Database>(path, mode)) {}

StudyStore StudyStore::OpenOrCreate(const std::filesystem::path& path, const StudyIdentity& identity,
                                    const Study& study) {
  StudyStore store(path, Database::Mode::kCreate);
  store.Create(identity, study);
  store.Load();
  store.RequireSame(identity);
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
  database_->Execute(std::string("UPDATE study SET layout = '") + kLayout + "'");
  transaction.Commit();
}

const std::string& StudyStore::Identify(const std::string& column) const {
  for (const auto& [name, value] : identity_) {
    if (name == column) return value;
  }
  throw std::invalid_argument("no column " + Quote(column));
}

void StudyStore::RequireSame(const StudyIdentity& other) const {
  constexpr size_t kReadable = 64;
  for (const auto& [column, value] : other) {
    const std::string& own = Identify(column);
    if (own == value) continue;
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

std::vector<TrialRow> StudyStore::ReadRows(long first) const {
  Statement select(database_.get(),
                   "SELECT " + ListColumns() + " FROM trials WHERE trial >= ? ORDER BY trial");
  select.Bind(1, static_cast<long long>(first));
  std::vector<TrialRow> rows;
  while (select.Step()) {
    TrialRow row;
    int column = 0;
    row.trial.number = static_cast<long>(select.GetWhole(column++));
    row.trial.seed = static_cast<std::uint64_t>(select.GetWhole(column++));
    for (size_t i = 0; i < study_.variations.size(); ++i) {
      row.trial.parameters.push_back(select.GetNumber(column++));
    }
    const std::string outcome = select.GetText(column++);
    if (!FindOutcome(outcome)) {
      throw InputError(database_->name() + ": trial " + std::to_string(row.trial.number) +
                       ": outcome: unknown, got " + Quote(outcome));
    }
    row.result.outcome = *FindOutcome(outcome);
    row.result.failure = select.GetText(column++);
    for (double& metric : row.result.metrics) metric = select.GetNumber(column++);
    row.machine = select.GetText(column++);
    rows.push_back(row);
  }
  return rows;
}

bool StudyStore::Has(long trial) const {
  Statement select(database_.get(), "SELECT 1 FROM trials WHERE trial = ?");
  select.Bind(1, static_cast<long long>(trial));
  return select.Step();
}

bool StudyStore::Claim(long trial) {
  Transaction transaction(database_.get());
  if (Has(trial)) return false;
  Statement owner(database_.get(), "SELECT process FROM claims WHERE trial = ?");
  owner.Bind(1, static_cast<long long>(trial));
  if (owner.Step() && IsRunningHere(owner.GetText(0))) return false;
  Statement claim(database_.get(), "INSERT OR REPLACE INTO claims VALUES (?, ?)");
  claim.Bind(1, static_cast<long long>(trial));
  claim.Bind(2, NameThisProcess());
  claim.Step();
  transaction.Commit();
  return true;
}

void StudyStore::Release(long trial) {
  Statement release(database_.get(), "DELETE FROM claims WHERE trial = ? AND process = ?");
  release.Bind(1, static_cast<long long>(trial));
  release.Bind(2, NameThisProcess());
  release.Step();
}

void StudyStore::Insert(const TrialRow& row) {
  std::string marks = "?, ?, ?, ?, ?";
  for (size_t i = 0; i < study_.variations.size() + kNumMetrics; ++i) marks += ", ?";
  Statement insert(database_.get(),
                   "INSERT OR IGNORE INTO trials (" + ListColumns() + ") VALUES (" + marks + ")");
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

void StudyStore::Add(const TrialRow& row) {
  Transaction transaction(database_.get());
  Insert(row);
  Release(row.trial.number);
  transaction.Commit();
}

void StudyStore::Remove(long trial) {
  Statement remove(database_.get(), "DELETE FROM trials WHERE trial = ?");
  remove.Bind(1, static_cast<long long>(trial));
  remove.Step();
}

void StudyStore::AddAll(const std::vector<TrialSource>& sources) {
  Transaction transaction(database_.get());
  struct Known {
    TrialRow row;
    const std::string* source;
  };
  std::map<long, Known> known;
  for (const TrialRow& row : ReadRows()) known.insert({row.trial.number, {row, &database_->name()}});
  for (const TrialSource& source : sources) {
    for (const TrialRow& row : source.rows) {
      const auto found = known.find(row.trial.number);
      if (found != known.end()) {
        const Known& other = found->second;
        if (IsFailed(row.result.outcome)) continue;
        if (IsFailed(other.row.result.outcome)) {
          Remove(row.trial.number);
        } else if (IsSame(other.row, row)) {
          continue;
        } else {
          throw InputError(source.name + ": trial " + std::to_string(row.trial.number) +
                           " has another result than in " + *other.source);
        }
      }
      Insert(row);
      known.insert_or_assign(row.trial.number, Known{row, &source.name});
    }
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
