#include <sched.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/child_process.h"
#include "harness/run/own_controller.h"

namespace dexcheck {
namespace {

// Time in which a program that has closed its output may end, s.
constexpr double kEndTime = 0.5;
// Time of waiting awake, if the last wait was over by then: to sleep and be woken by another core takes
// longer than many laws. After a longer wait the law is slow, or its process waits for a core.
constexpr std::chrono::microseconds kAwake(300);

class ProgramPeer final : public ControllerPeer {
 public:
  ProgramPeer(const OwnControllerSetup& setup, std::vector<std::string> words) : setup_(setup) {
    constexpr std::string_view kSocket = "unix:";
    if (setup.own().run.starts_with(kSocket)) {
      Connect(setup.own().run.substr(kSocket.size()));
    } else {
      Start(std::move(words));
    }
    SetTimeLimit(kPatience * setup_.own().time_limit);
  }

  /// Ends the program, by force when it does not end by itself.
  ~ProgramPeer() override {
    const dexcheck_message end{DEXCHECK_END, 0};
    (void)!::send(socket_.get(), &end, sizeof(end), MSG_NOSIGNAL | MSG_DONTWAIT);
    socket_.Close();
    ReportEnd();
  }

  uint32_t Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) override {
    Send(&hello, sizeof(hello));
    Send(setup_.robot_text.data(), setup_.robot_text.size());
    Send(setup_.scenario_text.data(), setup_.scenario_text.size());
    Send(joint_gains.data(), joint_gains.size_bytes());
    dexcheck_hello_answer answer{};
    Receive(&answer, sizeof(answer));
    if (std::memcmp(answer.magic, DEXCHECK_MAGIC, sizeof(DEXCHECK_MAGIC)) != 0)
      throw ControllerFailure(setup_.name + ": does not speak the protocol of controller_protocol.h");
    if (answer.protocol != DEXCHECK_PROTOCOL) {
      throw InputError(setup_.name + ": speaks protocol " + std::to_string(answer.protocol) +
                       ", this program " + std::to_string(DEXCHECK_PROTOCOL));
    }
    if ((answer.flags & DEXCHECK_PARAMETERS) == 0) SetTimeLimit(setup_.own().time_limit);
    return answer.flags;
  }

  void SetParameters() override {
    std::string text;
    for (const auto& [name, value] : setup_.own().parameters) text += name + " " + FormatNumber(value) + "\n";
    const dexcheck_message header{DEXCHECK_SET_PARAMETERS, static_cast<uint32_t>(text.size())};
    Send(&header, sizeof(header));
    Send(text.data(), text.size());
    const dexcheck_message reply = ReceiveMessage<InputError>();
    if (reply.type != DEXCHECK_SET_PARAMETERS)
      throw ControllerFailure(setup_.name + ": answered its parameters with message " +
                              std::to_string(reply.type));
    SetTimeLimit(setup_.own().time_limit);
  }

  void Begin() override {
    const dexcheck_message begin{DEXCHECK_BEGIN, 0};
    Send(&begin, sizeof(begin));
  }

  void Step(std::span<double> request, std::span<double> torques) override {
    const dexcheck_message header{DEXCHECK_STEP, static_cast<uint32_t>(request.size() - 1)};
    static_assert(sizeof(header) == sizeof(double));
    std::memcpy(request.data(), &header, sizeof(header));
    Send(request.data(), request.size_bytes());
    const dexcheck_message reply = ReceiveMessage<ControllerFailure>();
    if (reply.type != DEXCHECK_STEP || reply.doubles != torques.size()) {
      throw ControllerFailure(setup_.name + ": answered with message " + std::to_string(reply.type) + " of " +
                              std::to_string(reply.doubles) + " numbers, must be " +
                              std::to_string(DEXCHECK_STEP) + " of " + std::to_string(torques.size()));
    }
    Receive(torques.data(), torques.size_bytes());
  }

 private:
  void Start(std::vector<std::string> words) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw ControllerFailure(setup_.name + ": " + std::strerror(errno));
    socket_ = FileDescriptor(ends[0]);
    const FileDescriptor theirs(ends[1]);
    try {
      process_.emplace(setup_.name, Program{.words = std::move(words),
                                            .input = theirs.get(),
                                            .output = theirs.get(),
                                            .folder = setup_.own().folder});
    } catch (const Error& error) {
      throw ControllerFailure(error.what());
    }
  }

  void Connect(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof(address.sun_path)) throw InputError(setup_.name + ": is too long a name");
    std::memcpy(address.sun_path, path.c_str(), path.size());
    socket_ = FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
      throw InputError(setup_.name + ": cannot be connected to: " + std::strerror(errno));
  }

  void SetTimeLimit(double seconds) {
    time_limit_ = seconds;
    const timeval limit = ToTime(seconds);
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
  }

  /// Describes how the program ended, after a short wait; empty while it runs.
  std::string ReportEnd() {
    if (!process_) return "";
    const std::optional<ProcessEnd> end = process_->WaitFor(kEndTime);
    return end ? end->Describe() : "";
  }

  void Send(const void* data, size_t size) {
    const char* from = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t sent = ::send(socket_.get(), from, size, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
        throw ControllerFailure(setup_.name + ": read nothing for " + FormatNumber(time_limit_) + " s");
      if (sent < 0) {
        const std::string end = ReportEnd();
        throw ControllerFailure(setup_.name + ": " + (end.empty() ? "closed its standard input" : end));
      }
      from += sent;
      size -= static_cast<size_t>(sent);
    }
  }

  void Receive(void* data, size_t size) {
    char* to = static_cast<char*>(data);
    const auto begin = std::chrono::steady_clock::now();
    const auto is_short = [&] { return std::chrono::steady_clock::now() - begin < kAwake; };
    while (size > 0) {
      const bool looks = answers_soon_ && is_short();
      const ssize_t got = ::recv(socket_.get(), to, size, looks ? MSG_DONTWAIT : MSG_WAITALL);
      if (got < 0 && looks) ::sched_yield();
      if (got < 0 && (looks || errno == EINTR)) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
        throw ControllerFailure(setup_.name + ": did not answer within " + FormatNumber(time_limit_) + " s");
      if (got <= 0) {
        const std::string end = ReportEnd();
        throw ControllerFailure(setup_.name + ": " + (end.empty() ? "closed its standard output" : end));
      }
      to += got;
      size -= static_cast<size_t>(got);
    }
    answers_soon_ = is_short();
  }

  /// Returns the message; an error message is thrown as `Failure`.
  template <typename Failure>
  dexcheck_message ReceiveMessage() {
    constexpr uint32_t kLongest = 4096;
    dexcheck_message message{};
    Receive(&message, sizeof(message));
    if (message.type != DEXCHECK_ERROR) return message;
    std::string text(std::min(message.doubles, kLongest), '\0');
    Receive(text.data(), text.size());
    throw Failure(setup_.name + ": " + Abbreviate(text));
  }

  OwnControllerSetup setup_;
  FileDescriptor socket_;
  double time_limit_ = 0.0;   // s
  bool answers_soon_ = true;  // the last wait was short
  std::optional<ChildProcess> process_;
};

}  // namespace

timeval ToTime(double seconds) {
  timeval time{};
  time.tv_sec = static_cast<time_t>(seconds);
  time.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(time.tv_sec)));
  if (time.tv_sec == 0 && time.tv_usec == 0) time.tv_usec = 1;
  return time;
}

std::unique_ptr<ControllerPeer> MakeProgramPeer(const OwnControllerSetup& setup,
                                                std::vector<std::string> words) {
  return std::make_unique<ProgramPeer>(setup, std::move(words));
}

}  // namespace dexcheck
