#include "harness/descriptions/program_provider.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include "controller/common/text.h"

namespace dexcheck {

namespace {

using Clock = std::chrono::steady_clock;

// A mass matrix of a thousand joints is 20 MB of text.
constexpr size_t kLongestResult = size_t{1} << 26;
// Bytes of standard error that are kept: enough for the last line of a traceback.
constexpr size_t kKeptMessages = 4096;

}  // namespace

ProgramProcess::ProgramProcess(std::string command, double seconds)
    : command_(std::move(command)), seconds_(seconds) {
  int in[2] = {-1, -1};
  int out[2] = {-1, -1};
  int err[2] = {-1, -1};
  const bool piped = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in) == 0 &&
                     ::pipe2(out, O_CLOEXEC) == 0 && ::pipe2(err, O_CLOEXEC) == 0;
  const int error = errno;
  input_ = FileDescriptor(in[0]);
  output_ = FileDescriptor(out[0]);
  messages_ = FileDescriptor(err[0]);
  const FileDescriptor of_program[] = {FileDescriptor(in[1]), FileDescriptor(out[1]), FileDescriptor(err[1])};
  try {
    if (!piped) throw Error(std::generic_category().message(error));
    child_.emplace("program", Program{{"/bin/sh", "-c", command_}, in[1], out[1], err[1]});
  } catch (const Error& failure) {
    Fail(std::string("cannot be started: ") + failure.what());
  }
  for (const int own : {in[0], out[0], err[0]}) ::fcntl(own, F_SETFL, ::fcntl(own, F_GETFL) | O_NONBLOCK);
}

void ProgramProcess::Fail(const std::string& problem) const {
  throw ProgramError("program " + Quote(command_) + ": " + problem + LastWords());
}

std::string ProgramProcess::LastWords() const {
  const size_t end = said_.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return "";
  const size_t begin = said_.find_last_of('\n', end);
  return ", its last words: " + Quote(std::string_view(said_).substr(begin + 1, end - begin));
}

void ProgramProcess::FailEnded() {
  // The pipes are closed; what closed them without ending gets a moment.
  const std::optional<ProcessEnd> end = child_->WaitFor(0.5);
  ReadMessages();
  const std::string after =
      results_ == 0 ? " before its first result" : " after " + std::to_string(results_) + " results";
  if (!end) Fail("closed its standard output" + after);
  constexpr int kCannotRun = 126;
  if (results_ == 0 && (end->exit_code == kCannotRun || end->exit_code == kNotFoundExitCode)) {
    throw InputError("program " + Quote(command_) + ": cannot be run" + LastWords());
  }
  Fail(end->Describe() + after);
}

void ProgramProcess::Write(const std::string& text, size_t* written) {
  const ssize_t count =
      ::send(input_.get(), text.data() + *written, text.size() - *written, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (count > 0) *written += static_cast<size_t>(count);
  // A program that reads no more may still have written: its output says what became of it.
  if (count < 0 && errno != EAGAIN && errno != EINTR) *written = text.size();
}

bool ProgramProcess::ReadOutput() {
  char buffer[1 << 16];
  const ssize_t count = ::read(output_.get(), buffer, sizeof buffer);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return true;
  if (count <= 0) return false;
  pending_.append(buffer, static_cast<size_t>(count));
  return true;
}

void ProgramProcess::ReadMessages() {
  char buffer[4096];
  while (messages_.is_open()) {
    const ssize_t count = ::read(messages_.get(), buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) messages_.Close();
    if (count <= 0) return;
    said_.append(buffer, static_cast<size_t>(count));
    if (said_.size() > kKeptMessages) said_.erase(0, said_.size() - kKeptMessages);
  }
}

std::string ProgramProcess::Query(const std::string& line) {
  const std::string text = line + "\n";
  size_t written = 0;
  size_t searched = 0;
  const Clock::time_point deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_));
  while (true) {
    const size_t end = written == text.size() ? pending_.find('\n', searched) : std::string::npos;
    if (end != std::string::npos) {
      std::string result = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      if (!result.empty() && result.back() == '\r') result.pop_back();
      ++results_;
      return result;
    }
    searched = written == text.size() ? pending_.size() : 0;
    if (pending_.size() > kLongestResult)
      Fail("writes without end, more than " + std::to_string(kLongestResult >> 20) +
           " MB without an end of line");
    const double left = std::chrono::duration<double>(deadline - Clock::now()).count();
    if (left <= 0.0) {
      ReadMessages();
      Fail("wrote no result within " + FormatNumber(seconds_) + " s (--time-limit)");
    }
    pollfd ends[3] = {{output_.get(), POLLIN, 0}, {messages_.get(), POLLIN, 0}, {input_.get(), POLLOUT, 0}};
    const nfds_t count = written < text.size() ? 3 : 2;
    constexpr double kLongestWait = 1.0;  // s, so that a deadline far away overflows nothing
    const int ready = ::poll(ends, count, static_cast<int>(1e3 * std::min(left, kLongestWait)) + 1);
    if (ready < 0 && errno != EINTR) Fail("cannot be talked to: " + std::generic_category().message(errno));
    if (ready <= 0) continue;
    if ((ends[1].revents & (POLLIN | POLLHUP)) != 0) ReadMessages();
    if (count == 3 && ends[2].revents != 0) Write(text, &written);
    if ((ends[0].revents & (POLLIN | POLLHUP)) != 0 && !ReadOutput()) FailEnded();
  }
}

namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

OrderedJson ToList(const VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

OrderedJson MakeHello(const RobotDescription& robot, const ProgramLayout& layout) {
  OrderedJson joints = OrderedJson::array();
  for (const Joint& joint : robot.spec.joints) {
    joints.push_back({{"name", joint.name}, {"type", NameOf(joint.type)}});
    if (!joint.coupling) continue;
    joints.back()["follows"] = robot.spec.joints[static_cast<size_t>(joint.coupling->leader)].name;
    joints.back()["multiplier"] = joint.coupling->multiplier;
    joints.back()["offset"] = joint.coupling->offset;
  }
  const auto& g = robot.spec.gravity;
  return {{"dexcheck_protocol", kProgramProtocol},
          {"request", "hello"},
          {"robot",
           {{"name", robot.spec.name},
            {"source", robot.spec.source},
            {"gravity", {g[0], g[1], g[2]}},
            {"base", layout.is_floating() ? "floating" : "fixed"},
            {"joints", joints}}},
          {"layout", layout.ToJson()}};
}

}  // namespace

ProgramProvider::ProgramProvider(const std::string& command, const RobotDescription& robot,
                                 const ProgramOptions& options)
    : LayoutProvider(ProgramLayout(robot)),
      robot_(robot),
      process_(command, options.seconds),
      source_("program " + Quote(command)),
      name_(command) {
  const Json result = Query(MakeHello(robot, layout()));
  if (!result.contains("dexcheck_protocol") || result.at("dexcheck_protocol") != kProgramProtocol) {
    throw InputError(
        source_ + ": dexcheck_protocol: must be " + std::to_string(kProgramProtocol) + ", got " +
        (result.contains("dexcheck_protocol") ? Abbreviate(result.at("dexcheck_protocol").dump()) : "none"));
  }
  if (result.contains("name") && result.at("name").is_string()) {
    name_ = Abbreviate(result.at("name").get<std::string>());
  }
  set_layout(ProgramLayout(robot_, result, source_));
}

Json ProgramProvider::Query(const OrderedJson& request) {
  const std::string line =
      process_.Query(request.dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
  const std::optional<Json> parsed = ParseResult(line);
  if (!parsed) {
    throw InputError(source_ + ": must write a JSON object on one line (NaN and Infinity are none), got " +
                     Quote(line));
  }
  if (parsed->contains("error")) {
    const Json& error = parsed->at("error");
    throw ProgramError(source_ +
                       ": says: " + Abbreviate(error.is_string() ? error.get<std::string>() : error.dump()));
  }
  return *parsed;
}

TermResults ProgramProvider::Evaluate(long sample, const VectorXd& q, const VectorXd& xi) {
  const VectorXd positions = layout().WritePositions(q);
  const VectorXd velocities = layout().WriteVelocities(q, xi);
  const Json result =
      Query({{"request", "terms"}, {"id", sample}, {"q", ToList(positions)}, {"v", ToList(velocities)}});
  const std::string source = source_ + ": state " + std::to_string(sample);
  if (!result.contains("id") || result.at("id") != sample) {
    throw InputError(source + ": id: must be " + std::to_string(sample) + ", got " +
                     (result.contains("id") ? Abbreviate(result.at("id").dump()) : "none"));
  }
  TermResults terms = ReadResult(result, layout(), velocities, source);
  layout().ReadTerms(q, xi, &terms);
  return terms;
}

}  // namespace dexcheck
