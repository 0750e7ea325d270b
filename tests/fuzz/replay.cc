// main of a fuzz target without libFuzzer: runs it once on every file of a folder, or with --mutated COUNT on
// as many inputs that are made of them, always the same ones. One that fails is written to the file
// "finding".

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

/// The input that is tried now, for the handler of signals.
const std::string* current = nullptr;

void KeepFinding(int signal) {
  const int file = ::open("finding", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0 && ::write(file, current->data(), current->size()) >= 0) ::close(file);
  std::signal(signal, SIG_DFL);
  ::raise(signal);
}

void Try(const std::string& text) {
  current = &text;
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

std::vector<std::string> ReadFolder(const char* folder, bool show) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<std::string> texts;
  for (const std::filesystem::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    if (!show) continue;
    std::printf("%s\n", path.c_str());
    std::fflush(stdout);
    Try(texts.back());
  }
  return texts;
}

/// Makes inputs of others, as fuzzers do: bits, bytes, ranges, numbers, and parts of other inputs.
class Mutator {
 public:
  explicit Mutator(std::vector<std::string> seeds) : seeds_(std::move(seeds)) {}

  std::string Next() {
    std::string text = Choose(seeds_);
    const size_t changes = size_t{1} << Draw(6);
    for (size_t i = 0; i < changes; ++i) Change(&text);
    return text;
  }

 private:
  size_t Draw(size_t below) { return below > 0 ? random_() % below : 0; }
  const std::string& Choose(const std::vector<std::string>& texts) { return texts[Draw(texts.size())]; }

  void Change(std::string* text) {
    constexpr size_t kLongest = 16384;
    static const std::vector<std::string> kWords = {"1e999",  "-1", "nan", "0", "99999999999999999999",
                                                    "1e-320", "\"", "'",   "[", "]",
                                                    "{",      "}",  "<",   ">", "/",
                                                    "&",      "#",  "\n",  "=", ".",
                                                    ",",      "-",  "\t"};
    const size_t at = Draw(text->size() + 1);
    const size_t length = Draw(std::min<size_t>(text->size() - at, 64) + 1);
    switch (Draw(7)) {
      case 0:
        if (at < text->size()) (*text)[at] = static_cast<char>((*text)[at] ^ (1 << Draw(8)));
        break;
      case 1:
        if (at < text->size()) (*text)[at] = static_cast<char>(Draw(256));
        break;
      case 2:
        text->erase(at, length);
        break;
      case 3:
        text->insert(Draw(text->size() + 1), text->substr(at, length));
        break;
      case 4:
        text->insert(at, Choose(kWords));
        break;
      case 5: {
        const size_t digit = text->find_first_of("0123456789", at);
        if (digit == std::string::npos) break;
        text->replace(digit, text->find_first_not_of("0123456789.e+-", digit) - digit, Choose(kWords));
        break;
      }
      default: {
        const std::string& other = Choose(seeds_);
        const size_t from = Draw(other.size() + 1);
        text->replace(at, length, other.substr(from, Draw(256)));
      }
    }
    if (text->size() > kLongest) text->resize(kLongest);
  }

  std::vector<std::string> seeds_;
  std::mt19937 random_{1};
};

}  // namespace

int main(int argc, char** argv) {
  const bool mutates = argc == 4 && std::string_view(argv[1]) == "--mutated";
  const long count = mutates ? std::atol(argv[2]) : 0;
  if (!mutates && argc != 2) {
    std::fprintf(stderr, "usage: %s [--mutated COUNT] FOLDER\n", argv[0]);
    return 2;
  }
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM}) {
    std::signal(signal, KeepFinding);
  }
  std::vector<std::string> seeds = ReadFolder(argv[argc - 1], !mutates);
  if (seeds.empty()) {
    std::fprintf(stderr, "no files to replay\n");
    return 1;
  }
  Mutator mutator(std::move(seeds));
  for (long i = 0; i < count; ++i) {
    constexpr unsigned kSlow = 20;  // s
    ::alarm(kSlow);
    Try(mutator.Next());
  }
  if (mutates) std::printf("%ld inputs\n", count);
  return 0;
}
