// How many faults in files are named: robots drawn anew are written twice, by code that shares nothing with
// the search, with faults in what is written. The files, and what was made, go to a folder with
// DEXCHECK_DRAWN_FILES=FOLDER; another draw is made with DEXCHECK_DRAWN_SEED=N.
// DEXCHECK_DRAWN_ONLY=pair0007,pair0012 looks at these cases only.

#include "harness/corrections/corrections.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "harness/corrections/read_printed.h"
#include "tests/harness/corrections/drawn_faults.h"

namespace dexcheck::testing::corrections_test {
namespace {

enum class Score { kNamed, kClass, kMissed };

/// Whether an item is at a fault's places, and at no others but those of the other faults.
bool IsAtPlaces(const MadeFault& made, const std::vector<MadeFault>& all, const CorrectionItem& item) {
  const auto has = [&](const std::string& place) {
    return std::ranges::find(item.places, place) != item.places.end();
  };
  if (made.any_place) return std::ranges::any_of(made.places, has);
  const auto is_made = [&](const std::string& place) {
    if (std::ranges::find(made.hardly, place) != made.hardly.end()) return true;
    return std::ranges::any_of(all, [&](const MadeFault& fault) {
      return std::ranges::find(fault.places, place) != fault.places.end();
    });
  };
  return std::ranges::all_of(made.places, has) && std::ranges::all_of(item.places, is_made);
}

bool IsOfKind(const MadeFault& made, const CorrectionItem& item) {
  return std::ranges::find(made.kinds, item.fault.kind) != made.kinds.end();
}

/// Whether an item is about a fault's quantity: an inertial's, or an origin's, or its own.
bool IsAbout(const MadeFault& made, const CorrectionItem& item) {
  if (item.fault.of == made.of) return true;
  if (item.fault.whole) return IsOfBody(item.fault.of) == IsOfBody(made.of);
  return false;
}

Score Judge(const MadeFault& made, const std::vector<MadeFault>& all, const FileCorrections& found) {
  Score best = Score::kMissed;
  for (const CorrectionItem& item : found.items) {
    if (IsAbout(made, item) && IsOfKind(made, item) && IsAtPlaces(made, all, item)) return Score::kNamed;
    for (const CorrectionItem& rival : item.rivals) {
      if (IsAbout(made, rival) && IsOfKind(made, rival) && IsAtPlaces(made, all, rival)) best = Score::kClass;
    }
  }
  return best;
}

/// Items that are about no fault's quantity and place, nor is any of the alternatives listed with them.
int CountInvented(const std::vector<MadeFault>& made, const FileCorrections& found) {
  const auto is_made = [&](const CorrectionItem& item) {
    return std::ranges::any_of(made, [&](const MadeFault& fault) {
      return IsAbout(fault, item) && std::ranges::any_of(item.places, [&](const std::string& place) {
               return std::ranges::find(fault.places, place) != fault.places.end();
             });
    });
  };
  return static_cast<int>(std::ranges::count_if(found.items, [&](const CorrectionItem& item) {
    return !is_made(item) && std::ranges::none_of(item.rivals, is_made);
  }));
}

struct Case {
  std::string a, b, end_a, end_b;
  std::vector<MadeFault> made;
};

struct Tally {
  int faults = 0, named = 0, in_class = 0, missed = 0, invented = 0, cases_with_invented = 0;
};

class Campaign {
 public:
  Campaign(unsigned seed, std::string name) : random_(seed), name_(std::move(name)) {
    if (const char* const folder = std::getenv("DEXCHECK_DRAWN_FILES")) folder_ = folder;
  }

  /// Draws two files, the first with faults of these kinds; none where one of them does not show.
  /// @param beside_table the second file is a parameter file.
  std::optional<Case> DrawCase(const std::vector<std::string>& faults, bool beside_table = false) {
    using Format = WrittenForm::Format;
    DrawnRobot robot = DrawRobot(&random_);
    WrittenForm form_a, form_b;
    const auto draw = [&](int count) { return std::uniform_int_distribution(0, count - 1)(random_); };
    form_a.format = draw(3) == 0 ? Format::kMjcf : Format::kUrdf;
    form_b.format = draw(3) == 0 ? Format::kUrdf : Format::kMjcf;
    if (std::ranges::find(faults, "gravity_number") != faults.end())
      form_a.format = form_b.format = Format::kMjcf;
    form_a.digits = 5 + draw(5);
    form_b.digits = 5 + draw(5);
    form_a.euler = draw(3) == 0;
    form_b.euler = draw(3) == 0;
    form_b.principal = draw(3) == 0;
    form_b.seed = static_cast<unsigned>(random_());
    if (form_b.format == Format::kMjcf) {
      form_b.other_names = draw(2) == 0;
      form_b.fuses = draw(3) == 0;
      form_b.other_frames = draw(4) == 0;
    }
    if (beside_table) {
      form_b = {};
      form_b.format = Format::kToml;
      form_b.digits = 6 + draw(4);
      for (DrawnLink& link : robot.links) {  // a table states all ranges
        if (!link.range) link.range = {-3.0, 3.0};
      }
    }
    DrawnRobot wrong = robot;
    Case made;
    for (const std::string& name : faults) {
      std::optional<MadeFault> fault = MakeFault(name, form_a, &random_, &wrong);
      if (!fault) return std::nullopt;
      made.made.push_back(*std::move(fault));
    }
    for (size_t i = 0; i < made.made.size(); ++i) {
      const MadeFault& fault = made.made[i];
      for (size_t k = 0; k < i; ++k) {
        if (SharePlace(made.made[k], fault)) return std::nullopt;
      }
      // A link that is missing cannot have a fault, and one of the names that are exchanged is another's.
      if (made.made.size() > 1 && (fault.name.ends_with("missing") || fault.name == "names_exchanged"))
        return std::nullopt;
      // A parameter file does not state it.
      if (beside_table && fault.of == SiteKind::kEffort) return std::nullopt;
    }
    made.a = WriteRobot(wrong, form_a);
    made.b = WriteRobot(robot, form_b);
    made.end_a = EndOf(form_a);
    made.end_b = EndOf(form_b);
    return made;
  }

  void Try(const Case& drawn) {
    const std::string number = fmt::format("{}{:04}", name_, count_++);
    const char* const only = std::getenv("DEXCHECK_DRAWN_ONLY");
    if (only != nullptr && std::string_view(only).find(number) == std::string_view::npos) return;
    if (!folder_.empty()) Store(drawn, number);
    FileCorrections found;
    try {
      const DescriptionFile a("a" + drawn.end_a, drawn.a, {});
      const DescriptionFile b("b" + drawn.end_b, drawn.b, {});
      found = FindCorrections(ReadPrintedRobot(a, &b), ReadPrintedRobot(b, &a));
    } catch (const std::exception& error) {
      // The engine refuses masses and inertias that no body has. Everything else that is drawn must be read.
      EXPECT_TRUE(std::ranges::any_of(
          drawn.made, [](const MadeFault& fault) { return IsOfBody(fault.of) || IsWhole(fault); }))
          << number << " refused: " << error.what();
      ++refused;
      return;
    }
    const int invented = CountInvented(drawn.made, found);
    bool prints = invented > 0;
    for (const MadeFault& fault : drawn.made) {
      const Score score = Judge(fault, drawn.made, found);
      prints = prints || score == Score::kMissed;
      ++tally.faults;
      ++(score == Score::kNamed ? tally.named : score == Score::kClass ? tally.in_class : tally.missed);
      if (score == Score::kMissed) ++missed_by_name[fault.name];
    }
    tally.invented += invented;
    tally.cases_with_invented += invented > 0 ? 1 : 0;
    if (drawn.made.empty() && !found.agrees) prints = true;
    if (!prints || std::getenv("DEXCHECK_DRAWN_SHOW") == nullptr) return;
    fmt::print("{}{}{}:", number, drawn.end_a, drawn.end_b);
    for (const MadeFault& fault : drawn.made)
      fmt::print(" {} [{}]{}", fault.name, fmt::join(fault.places, ", "),
                 Judge(fault, drawn.made, found) == Score::kMissed ? " MISSED" : "");
    fmt::print("\n");
    for (const CorrectionItem& item : found.items) {
      fmt::print("    {:.0f}: {}\n", item.bits, DescribeItem(item));
      for (const CorrectionItem& rival : item.rivals) fmt::print("        or {}\n", DescribeItem(rival));
    }
    for (const std::string& left : found.unexplained) fmt::print("    not explained: {}\n", left);
  }

  std::mt19937* random() { return &random_; }
  void Print() const {
    fmt::print(
        "{}: {} faults, {} named, {} class, {} missed; {} items that are not there in {} cases, {} refused\n",
        name_, tally.faults, tally.named, tally.in_class, tally.missed, tally.invented,
        tally.cases_with_invented, refused);
  }

  Tally tally;
  int refused = 0;
  std::map<std::string, int> missed_by_name;

 private:
  static bool IsWhole(const MadeFault& fault) {
    return fault.name == "inertial_dropped" || fault.name.ends_with("exchanged") ||
           fault.name.ends_with("missing");
  }

  static bool SharePlace(const MadeFault& a, const MadeFault& b) {
    if (a.of != b.of && !(IsOfBody(a.of) && IsOfBody(b.of) && (IsWhole(a) || IsWhole(b)))) return false;
    return std::ranges::any_of(a.places, [&](const std::string& place) {
      return std::ranges::find(b.places, place) != b.places.end();
    });
  }

  void Store(const Case& drawn, const std::string& number) const {
    const std::filesystem::path at = folder_ / number;
    std::filesystem::create_directories(at);
    std::ofstream(at / ("a" + drawn.end_a)) << drawn.a;
    std::ofstream(at / ("b" + drawn.end_b)) << drawn.b;
    std::ofstream truth(at / "made");
    for (const MadeFault& fault : drawn.made)
      truth << fault.name << "|" << static_cast<int>(fault.of) << "|"
            << fmt::format("{}", fmt::join(fault.places, ",")) << "\n";
  }

  std::mt19937 random_;
  std::string name_;
  std::filesystem::path folder_;
  int count_ = 0;
};

unsigned TakeSeed(unsigned otherwise) {
  const char* const seed = std::getenv("DEXCHECK_DRAWN_SEED");
  return seed == nullptr ? otherwise : otherwise + static_cast<unsigned>(std::atoi(seed));
}

TEST(CorrectionCampaign, NamesSingleFaults) {
  Campaign campaign(TakeSeed(101), "single");
  constexpr int kOfEach = 3;
  for (const std::string& name : ListFaultNames()) {
    for (int k = 0, tries = 0; k < kOfEach && tries < 60; ++tries) {
      const std::optional<Case> drawn = campaign.DrawCase({name});
      if (!drawn) continue;
      campaign.Try(*drawn);
      ++k;
    }
  }
  campaign.Print();
  for (const auto& [name, count] : campaign.missed_by_name) fmt::print("  missed {}: {}\n", name, count);
  EXPECT_GE(campaign.tally.named + campaign.tally.in_class, 0.96 * campaign.tally.faults);
  EXPECT_LE(campaign.tally.cases_with_invented, 5);
}

/// Draws so many cases of several faults each, and has them named.
void TryMany(int cases, int faults, bool beside_table, Campaign* campaign) {
  const std::vector<std::string> names = ListFaultNames();
  while (cases > 0) {
    std::vector<std::string> drawn;
    for (int k = 0; k < faults; ++k)
      drawn.push_back(names[std::uniform_int_distribution<size_t>(0, names.size() - 1)(*campaign->random())]);
    const std::optional<Case> made = campaign->DrawCase(drawn, beside_table);
    if (!made) continue;
    campaign->Try(*made);
    --cases;
  }
  campaign->Print();
  for (const auto& [name, count] : campaign->missed_by_name) fmt::print("  missed {}: {}\n", name, count);
}

TEST(CorrectionCampaign, NamesPairs) {
  Campaign campaign(TakeSeed(202), "pair");
  TryMany(80, 2, false, &campaign);
  EXPECT_GE(campaign.tally.named + campaign.tally.in_class, 0.92 * campaign.tally.faults);
  EXPECT_LE(campaign.tally.cases_with_invented, 6);
}

TEST(CorrectionCampaign, NamesTriples) {
  Campaign campaign(TakeSeed(404), "triple");
  TryMany(50, 3, false, &campaign);
  EXPECT_GE(campaign.tally.named + campaign.tally.in_class, 0.88 * campaign.tally.faults);
  EXPECT_LE(campaign.tally.cases_with_invented, 8);
}

TEST(CorrectionCampaign, NamesFaultsBesideParameterFiles) {
  Campaign campaign(TakeSeed(505), "table");
  TryMany(60, 1, true, &campaign);
  EXPECT_GE(campaign.tally.named + campaign.tally.in_class, 0.95 * campaign.tally.faults);
  EXPECT_LE(campaign.tally.cases_with_invented, 3);
}

TEST(CorrectionCampaign, AgreesWithoutFaults) {
  Campaign campaign(TakeSeed(303), "right");
  constexpr int kRight = 40;
  for (int k = 0; k < kRight; ++k) campaign.Try(*campaign.DrawCase({}, k % 4 == 0));
  campaign.Print();
  EXPECT_EQ(campaign.tally.invented, 0);
}

}  // namespace
}  // namespace dexcheck::testing::corrections_test
