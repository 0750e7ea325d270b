#include "tests/common/browser.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <chrono>
#include <csignal>
#include <optional>
#include <stdexcept>
#include <thread>

namespace dexcheck::testing {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kMaxSeconds = 150;  // of one answer, above the time that a script may take
constexpr int kMaxLife = 1200;    // s, of a browser
constexpr auto kPause = std::chrono::milliseconds(50);

/// The number that stands behind a text and any spaces.
std::optional<size_t> ReadNumberAfter(const std::string& text, const std::string& mark) {
  size_t at = text.find(mark);
  if (at == std::string::npos) return std::nullopt;
  at = text.find_first_not_of(' ', at + mark.size());
  if (at == std::string::npos || text[at] < '0' || text[at] > '9') return std::nullopt;
  return std::stoul(text.substr(at));
}

/// Whether an HTTP answer has as many bytes as it says.
bool IsWhole(const std::string& answer) {
  const size_t head = answer.find("\r\n\r\n");
  if (head == std::string::npos) return false;
  std::string headers = answer.substr(0, head);
  for (char& c : headers) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const std::optional<size_t> length = ReadNumberAfter(headers, "content-length:");
  return length && answer.size() >= head + 4 + *length;
}

/// Sends an HTTP request to this machine and returns the answer's body.
std::string Exchange(int port, const std::string& request) {
  const int connection = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience = {kMaxSeconds, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string answer;
  if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    for (size_t sent = 0; sent < request.size();) {
      const ssize_t count = ::send(connection, request.data() + sent, request.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) break;
      sent += static_cast<size_t>(count);
    }
    char buffer[65536];
    while (!IsWhole(answer)) {
      const ssize_t count = ::read(connection, buffer, sizeof buffer);
      if (count <= 0) break;
      answer.append(buffer, static_cast<size_t>(count));
    }
  }
  ::close(connection);
  const size_t head = answer.find("\r\n\r\n");
  if (head == std::string::npos) throw std::runtime_error("no answer from chromedriver");
  return answer.substr(head + 4);
}

}  // namespace

Browser::Browser() {
  const std::filesystem::path out = folder_.path() / "chromedriver.txt";
  ProgramOptions options;
  options.out = out;
  options.seconds = kMaxLife;
  driver_ = std::make_unique<Program>(std::vector<std::string>{DEXCHECK_CHROMEDRIVER, "--port=0"}, options);
  const auto deadline = Clock::now() + std::chrono::seconds(30);
  for (; port_ == 0; std::this_thread::sleep_for(kPause)) {
    const std::string text = std::filesystem::exists(out) ? ReadText(out) : "";
    // The whole line is there when the full stop at its end is.
    const auto port = ReadNumberAfter(text, "started successfully on port");
    if (port && text.find('.', text.find("successfully on port")) != std::string::npos) {
      port_ = static_cast<int>(*port);
    }
    if (Clock::now() > deadline) throw std::runtime_error("chromedriver did not start");
  }
  // Through a pipe, since a port's address asks for `localhost`, which a bare Debian without /etc/hosts does
  // not know.
  const Json chromium = {
      {"args",
       {"--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", "--remote-debugging-pipe"}}};
  // A page that draws in software beside other tests may keep a script waiting for longer than the usual 30
  // s.
  const Json wanted = {{"goog:chromeOptions", chromium},
                       {"goog:loggingPrefs", {{"browser", "ALL"}}},
                       {"timeouts", {{"script", 120000}}}};
  try {
    const Json session = Call("POST", "/session", {{"capabilities", {{"alwaysMatch", wanted}}}});
    session_ = "/session/" + session.at("sessionId").get<std::string>();
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("Chromium cannot start here: ") + error.what());
  }
}

Browser& Browser::Shared() {
  static Browser shared;
  shared.Command("Emulation.clearDeviceMetricsOverride", Json::object());
  shared.SetDark(false);
  (void)shared.TakeConsole();
  return shared;
}

Browser::~Browser() {
  try {
    Call("DELETE", session_, Json::object());
  } catch (const std::exception&) {
    driver_->Signal(SIGTERM);
  }
}

void Browser::Open(const std::filesystem::path& page) const {
  Call("POST", session_ + "/url", {{"url", "file://" + std::filesystem::absolute(page).string()}});
}

void Browser::SetViewport(int width, int height, bool mobile) const {
  Command("Emulation.setDeviceMetricsOverride",
          {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", mobile}});
}

void Browser::SetDark(bool dark) const {
  const Json feature = {{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}};
  Command("Emulation.setEmulatedMedia", {{"features", Json::array({feature})}});
}

Json Browser::Run(const std::string& body) const {
  return Call("POST", session_ + "/execute/sync", {{"script", body}, {"args", Json::array()}});
}

bool Browser::WaitFor(const std::string& body, double seconds) const {
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (Run(body) != true) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(kPause);
  }
  return true;
}

int Browser::WorkControls() const {
  const Json count = Run(R"(
    const all = () => [...document.querySelectorAll('select, input, button, summary, [tabindex="0"], a[href^="#"]')]
      .filter(e => !e.disabled && e.getClientRects().length > 0);
    const set = (control, value) => {
      control.value = value;
      for (const name of ['input', 'change']) control.dispatchEvent(new Event(name, {bubbles: true}));
    };
    const work = control => {
      const old = control.value, {type, min, max} = control;
      if (control.tagName === 'SELECT') for (const {value} of [...control.options]) set(control, value);
      else if (type === 'range') for (const value of [min || 0, max || 100]) set(control, value);
      else if (type === 'text' || type === 'search') for (const value of ['(', 'x < 1', '*']) set(control, value);
      else {
        control.click();
        if (control.isConnected) control.click();  // back
        return;
      }
      set(control, old);
    };
    let i = 0;
    // A control may redraw its page, so the elements are listed again.
    for (; i < Math.min(all().length, 300); ++i) work(all()[i]);
    window.isAlive = false;
    requestAnimationFrame(() => setTimeout(() => { window.isAlive = true; }));
    return i;)");
  if (!WaitFor("return window.isAlive;", 60.0)) throw std::runtime_error("the page does not answer any more");
  const std::vector<std::string> messages = TakeConsole();
  if (!messages.empty()) throw std::runtime_error("after its controls were worked: " + messages.front());
  return count.get<int>();
}

void Browser::Drag(int from_x, int from_y, int to_x, int to_y) const {
  const auto move = [](int x, int y) {
    return Json{{"type", "pointerMove"}, {"duration", 50}, {"x", x}, {"y", y}};
  };
  const int middle_x = (from_x + to_x) / 2;
  const int middle_y = (from_y + to_y) / 2;
  Act(Json::array({move(from_x, from_y),
                   {{"type", "pointerDown"}, {"button", 0}},
                   move(middle_x, middle_y),
                   move(to_x, to_y),
                   {{"type", "pointerUp"}, {"button", 0}}}));
}

void Browser::DoubleClick(int x, int y) const {
  const Json down = {{"type", "pointerDown"}, {"button", 0}};
  const Json up = {{"type", "pointerUp"}, {"button", 0}};
  Act(Json::array({{{"type", "pointerMove"}, {"duration", 0}, {"x", x}, {"y", y}}, down, up, down, up}));
}

std::vector<std::string> Browser::TakeConsole() const {
  std::vector<std::string> messages;
  for (const Json& entry : Call("POST", session_ + "/se/log", {{"type", "browser"}})) {
    const std::string level = entry.at("level").get<std::string>();
    if (level == "SEVERE" || level == "WARNING") messages.push_back(entry.at("message").get<std::string>());
  }
  return messages;
}

Json Browser::Call(const std::string& method, const std::string& path, const Json& body) const {
  const std::string text = method == "DELETE" ? "" : body.dump();
  const Json answer = Json::parse(Exchange(
      port_, method + " " + path +
                 " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json\r\n"
                 "Content-Length: " +
                 std::to_string(text.size()) + "\r\n\r\n" + text));
  const Json& value = answer.at("value");
  if (value.is_object() && value.contains("error")) {
    throw std::runtime_error(method + " " + path + ": " + value.value("message", ""));
  }
  return value;
}

void Browser::Command(const std::string& name, const Json& parameters) const {
  Call("POST", session_ + "/goog/cdp/execute", {{"cmd", name}, {"params", parameters}});
}

void Browser::Act(const Json& pointer_actions) const {
  const Json mouse = {{"type", "pointer"},
                      {"id", "mouse"},
                      {"parameters", {{"pointerType", "mouse"}}},
                      {"actions", pointer_actions}};
  Call("POST", session_ + "/actions", {{"actions", Json::array({mouse})}});
}

}  // namespace dexcheck::testing
