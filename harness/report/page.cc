#include "harness/report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <system_error>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/report/html.h"
#include "harness/report/page_frame.h"

namespace dexcheck {
namespace {

constexpr std::uintmax_t kLargestEmbeddedVideo = 20'000'000;  // bytes
/// The verdict in the words of the page.
struct Headline {
  const char* tone;  ///< CSS class.
  std::string word;
  std::string sentence;
};

std::string FindString(const nlohmann::json& json, const char* group, const char* key) {
  if (!json.contains(group) || !json[group].is_object()) return "";
  const auto value = json[group].find(key);
  return value != json[group].end() && value->is_string() ? value->get<std::string>() : "";
}

double FindNumber(const nlohmann::json& json, const char* group, const char* key) {
  if (!json.contains(group) || !json[group].is_object()) return std::nan("");
  const auto value = json[group].find(key);
  return value != json[group].end() && value->is_number() ? value->get<double>() : std::nan("");
}

Headline FindHeadline(const RunData& run) {
  const nlohmann::json& summary = run.summary();
  if (summary.is_null()) {
    return {"open", "NO VERDICT",
            fmt::format("The run was cut off after {:.3f} s; what was recorded until then is below.",
                        run.time()[run.time().size() - 1])};
  }
  const std::string verdict = summary.value("verdict", "");
  if (verdict == "failed")
    return {"fail", "FAILED", "The run could not be completed: " + summary.value("failure", "")};
  if (verdict == "disagreement") {
    const std::string cause = FindString(summary, "attribution", "cause");
    return {"fail", "DISAGREEMENT",
            cause == "model"         ? "The two descriptions of the robot differ."
            : cause == "control law" ? "The torques are not those of the law, or do not do what is expected."
                                     : "The engine does not do what the equations say."};
  }
  if (run.checks().empty()) return {"open", "NOT CHECKED", "The run completed; nothing was checked."};
  return {"pass", "PASS", "Model, law, balance, prediction and assumptions hold at every step."};
}

/// One of the five questions.
struct Question {
  CheckCategory kind;
  const char* name;
  const char* text;
  const char* of_joints = text;  ///< The same of a robot that holds nothing.
};

constexpr std::array<Question, 5> kCategories = {
    {{CheckCategory::kModel, "Model", "same state, both descriptions"},
     {CheckCategory::kLaw, "Law", "torques against (53)-(55)", "torques against the law of the joints"},
     {CheckCategory::kInverseDynamics, "Balance", "engine's motion in the model's equations"},
     {CheckCategory::kForwardDynamics, "Prediction", "accelerations and contact forces", "accelerations"},
     {CheckCategory::kAssumption, "Assumptions", "no slip, level base, forces in cones",
      "joints within their ranges, motors within their limits, bodies apart"}}};

/// A button that brings the page to a time. @param words before the time.
Html MakeTimeButton(const char* style, const std::string& words, double time) {
  return FormatHtml("<button type=\"button\" class=\"{}\" data-time=\"{:.6f}\">{} {:.3f} s</button>", style,
                    time, words, time);
}

class Page {
 public:
  Page(const RunData& run, const PageContent& content) : run_(run), content_(content) {}

  std::string Make() {
    AddHead();
    AddVerdict();
    AddNavigation();
    html_ += "<main>\n";
    if (content_.scene.replay) html_ += MakeReplaySection();
    AddVideo();
    html_ += MakePlotSection(content_.figures);
    AddChecks();
    AddFigures();
    AddInputs();
    html_ += "</main>\n";
    AddFooter();
    return html_.markup();
  }

 private:
  /// Texts among the arguments are escaped.
  template <typename... Arguments>
  void Add(fmt::format_string<html_detail::Shown<Arguments>...> format, const Arguments&... arguments) {
    html_ += FormatHtml(format, arguments...);
  }

  std::string Text(const char* name) const { return run_.FindText(name); }

  void AddHead() { html_ += BeginPlotPage(fmt::format("{}: {}", FindHeadline(run_).word, Text("scenario"))); }

  void AddVerdict() {
    const Headline headline = FindHeadline(run_);
    const nlohmann::json& summary = run_.summary();
    const std::string description = summary.is_null() ? "" : summary.value("description", "");
    Add("<header>\n<h1><b>{}</b>{}{}</h1>\n<section class=\"verdict {}\" id=\"verdict\"><strong>{}</strong>"
        "<p>{}</p>",
        Text("scenario"), description.empty() ? "" : " – ", description, headline.tone, headline.word,
        headline.sentence);
    const std::string cause = FindString(summary, "attribution", "cause");
    if (!cause.empty() && cause != "none") {
      Add("<p>Cause: <b>{}</b>. Evidence: {}.</p>", cause, FindString(summary, "attribution", "evidence"));
    }
    if (const CheckLine* const first = FindFirstFailure()) {
      Add("<p>{}</p>", MakeTimeButton("", "See it: " + first->name + " fails from", first->failed_at));
    }
    if (!summary.is_null() && summary.value("interrupted", false)) {
      Add("<p>The run was stopped by hand after {:.3f} s.</p>", run_.time()[run_.time().size() - 1]);
    }
    html_ += "</section>\n";
    AddCategories();
    AddTiles();
    html_ += "</header>\n";
  }

  /// The check that failed first in time; null when none did in the run.
  [[nodiscard]] const CheckLine* FindFirstFailure() const {
    const CheckLine* first = nullptr;
    for (const CheckLine& check : run_.checks()) {
      if (check.pass || check.constant) continue;
      if (first == nullptr || check.failed_at < first->failed_at) first = &check;
    }
    return first;
  }

  /// Whether the robot holds nothing, and its joints follow a motion of their own.
  [[nodiscard]] bool MovesJoints() const { return run_.Find("joints/q_d") != nullptr; }
  [[nodiscard]] const char* TextOf(const Question& question) const {
    return MovesJoints() ? question.of_joints : question.text;
  }

  /// What the checks of a question say together.
  struct Answer {
    std::vector<const CheckLine*> checks;
    const char* tone = "open";  ///< CSS class.
    std::string word = "not asked";
    std::string extent;  ///< "3 checks, at most 40 % of a bound".
    bool fails = false;
  };

  [[nodiscard]] Answer FindAnswer(const Question& question) const {
    Answer answer;
    long failed = 0;
    double fraction = 0.0;
    for (const CheckLine& check : run_.checks()) {
      if (check.kind != question.kind) continue;
      answer.checks.push_back(&check);
      failed += check.pass ? 0 : 1;
      fraction = std::max(fraction, check.fraction());
    }
    const size_t count = answer.checks.size();
    if (count == 0) return answer;
    answer.fails = failed > 0;
    answer.tone = answer.fails ? "fail" : "pass";
    answer.word = answer.fails ? fmt::format("{} of {} fail", failed, count) : "holds";
    answer.extent =
        fmt::format("{}, at most {} of a bound", count == 1 ? "1 check" : fmt::format("{} checks", count),
                    FormatFraction(fraction));
    return answer;
  }

  void AddCategories() {
    if (run_.checks().empty()) return;
    html_ += "<div class=\"tiles\">\n";
    for (const Question& question : kCategories) {
      const Answer answer = FindAnswer(question);
      const Html text = FormatHtml("<b>{}: {}</b><span>{}</span><span>{}</span>", question.name, answer.word,
                                   TextOf(question), answer.extent);
      if (answer.checks.empty()) {
        Add("<div class=\"card question {}\">{}</div>\n", answer.tone, text);
      } else {
        Add("<a class=\"card question {}\" href=\"#checks-{}\">{}</a>\n", answer.tone, NameOf(question.kind),
            text);
      }
    }
    html_ += "</div>\n";
  }

  void AddTile(const std::string& value, const char* label) {
    Add("<div class=\"card\"><b>{}</b><span>{}</span></div>\n", value, label);
  }

  void AddTiles() {
    const nlohmann::json& summary = run_.summary();
    html_ += "<div class=\"tiles\">\n";
    const auto tracking = [&](const char* key, const char* unit) {
      const double value = FindNumber(summary, "tracking", key);
      return std::isfinite(value) ? FormatShort(value) + unit : std::string("–");
    };
    if (std::isfinite(FindNumber(summary, "tracking", "joint_error_max_rad"))) {
      AddTile(tracking("joint_error_max_rad", " rad"), "largest error of a joint");
    } else {
      AddTile(tracking("position_error_max_m", " m"), "largest position error of the object");
      AddTile(tracking("orientation_error_max_rad", " rad"), "largest orientation error");
    }
    const double simulated =
        summary.is_null() ? run_.time()[run_.time().size() - 1] : summary.value("simulated_s", 0.0);
    AddTile(fmt::format("{:.4g} s", simulated),
            fmt::format("simulated, {} steps", run_.time().size()).c_str());
    for (const CheckLine& check : run_.checks()) {
      if (check.name == "cone_use")
        AddTile(FormatFraction(check.max), "of the fingertips' friction used, at most");
    }
    AddClearanceTiles();
    const double factor = FindNumber(summary, "speed", "real_time_factor");
    if (std::isfinite(factor)) AddTile(fmt::format("{:.2g} ×", factor), "real time");
    html_ += "</div>\n";
  }

  /// By class of bodies that are not meant to touch.
  void AddClearanceTiles() {
    if (run_.summary().is_null() || !run_.summary().contains("clearance")) return;
    for (const auto& [pairs, nearest] : run_.summary()["clearance"].items()) {
      std::string name = pairs;
      std::replace(name.begin(), name.end(), '_', ' ');
      const double distance = nearest.value("smallest_m", std::nan(""));
      AddTile(fmt::format("{:.1f} mm", 1e3 * distance),
              fmt::format("{}: nearest are {}", name, nearest.value("bodies", "")).c_str());
    }
  }

  void AddNavigation() {
    html_ += "<nav><div><a href=\"#verdict\">Verdict</a>";
    if (content_.scene.replay) html_ += "<a href=\"#replay\">Replay</a>";
    if (!content_.video.empty()) html_ += "<a href=\"#video\">Video</a>";
    html_ += "<a href=\"#plots\">Plots</a>";
    if (!run_.checks().empty()) html_ += "<a href=\"#checks\">Checks</a>";
    html_ += "<a href=\"#figures\">Figures</a><a href=\"#inputs\">Inputs</a></div></nav>\n";
  }

  void AddCheckRow(const CheckLine& check) {
    const double fraction = check.fraction();
    std::string where = check.where;
    if (!check.constant) where += fmt::format("{}{:.3f} s", where.empty() ? "" : ", ", check.at_time);
    const std::string unit = check.unit == "1" ? "" : " " + check.unit;
    const Html verdict = check.pass || check.constant
                             ? FormatHtml("<span class=\"badge\">{}</span>", check.pass ? "holds" : "differs")
                             : MakeTimeButton("badge", "fails from", check.failed_at);
    const std::string cause = [&]() -> std::string {
      const nlohmann::json& summary = run_.summary();
      if (check.pass || !summary.contains("attribution")) return "";
      const nlohmann::json& causes = summary["attribution"];
      return causes.contains("checks") ? causes["checks"].value(check.name, "") : "";
    }();
    Add("<tr class=\"{}\"><td><code>{}</code><small>{}</small></td><td>{}{}</td><td class=\"value number\" "
        "data-label=\"worst\">{}{}</td>"
        "<td class=\"value number\" data-label=\"bound\">{}{}</td>"
        "<td data-label=\"of bound\"><span class=\"number\">{}</span><span class=\"meter\"><i "
        "style=\"width:{:.1f}%\">"
        "</i></span></td><td class=\"where\" data-label=\"{}\"><small>{}</small></td></tr>\n",
        check.pass ? "pass" : "fail", check.name, check.description, verdict,
        cause.empty() ? Html() : FormatHtml("<small>cause: {}</small>", cause), FormatShort(check.max),
        check.max == 0.0 ? "" : unit, FormatShort(check.bound), check.bound == 0.0 ? "" : unit,
        FormatFraction(fraction), 100.0 * std::clamp(std::isfinite(fraction) ? fraction : 1.0, 0.0, 1.0),
        where.empty() ? "" : "at", where);
  }

  void AddCheckTable(const std::vector<const CheckLine*>& checks) {
    html_ +=
        "<table class=\"checks\"><thead><tr><th>check</th><th>verdict</th><th "
        "class=\"value\">worst</th>"
        "<th class=\"value\">bound</th><th>of bound</th><th>where, when</th></tr></thead><tbody>\n";
    for (const CheckLine* check : checks) AddCheckRow(*check);
    html_ += "</tbody></table>\n";
  }

  /// The checks of a question, folded unless one fails.
  void AddAnswer(const Question& question, const Answer& answer) {
    std::vector<const CheckLine*> shown;
    std::vector<const CheckLine*> equal_constants;
    for (const CheckLine* check : answer.checks) {
      (check->constant && check->pass ? equal_constants : shown).push_back(check);
    }
    Add("<details class=\"answer {}\" id=\"checks-{}\"{}><summary><b>{}</b> <span class=\"badge\">{}</span> "
        "{}: {}</summary>\n",
        answer.tone, NameOf(question.kind), answer.fails ? " open" : "", question.name, answer.word,
        TextOf(question), answer.extent);
    if (!shown.empty()) AddCheckTable(shown);
    if (!equal_constants.empty()) {
      Add("<details><summary>{} constants of both descriptions agree</summary>\n", equal_constants.size());
      AddCheckTable(equal_constants);
      html_ += "</details>\n";
    }
    html_ += "</details>\n";
  }

  void AddChecks() {
    if (run_.checks().empty()) return;
    html_ +=
        "<h2 id=\"checks\">Checks</h2>\n<p class=\"soft\">What failed first, then by fraction of the bound. "
        "A "
        "bound is "
        "what rounding, or the tolerance of the assumption, can explain.</p>\n<div class=\"card\">\n";
    for (const Question& question : kCategories) {
      const Answer answer = FindAnswer(question);
      if (!answer.checks.empty()) AddAnswer(question, answer);
    }
    html_ += "</div>\n";
  }

  void AddVideo() {
    if (content_.video.empty()) return;
    html_ += "<h2 id=\"video\">Video</h2>\n";
    std::error_code error;
    if (std::filesystem::file_size(content_.video, error) > kLargestEmbeddedVideo || error) {
      Add("<p><a href=\"{}\">{}</a> (too large to be part of this page)</p>\n", content_.video_link,
          content_.video.filename().string());
      return;
    }
    html_ += "<video controls playsinline preload=\"metadata\" src=\"data:video/mp4;base64,";
    html_ += Html::Raw(EncodeBase64(ReadBytes(content_.video)));
    html_ += "\"></video>\n";
  }

  void AddCaption(const std::string& panel, const std::string& title) {
    Add("<figcaption>{}{}</figcaption>", panel.empty() ? Html() : FormatHtml("<b>Figure {}</b>", panel),
        title);
  }

  void AddFigures() {
    Add("<h2 id=\"figures\">Figures</h2>\n<p class=\"soft\">{}SVG and PNG files lie in the run's folder "
        "<code>figures</code>.</p>\n<div class=\"grid\">\n",
        MovesJoints() ? "" : "Numbers are those of the paper's figures. ");
    for (const Picture& picture : content_.scene.pictures) {
      html_ += "<figure class=\"card\">";
      AddCaption(picture.panel, picture.title);
      Add("<img alt=\"{}\" src=\"data:image/png;base64,{}\"></figure>\n", picture.title,
          EncodeBase64(ReadBytes(picture.file)));
    }
    for (const Figure& figure : content_.figures) {
      if (!figure.printed) continue;
      html_ += "<figure class=\"card\">";
      AddCaption(figure.panel, figure.title);
      html_ += MakeInlineSvg(ReadBytes(content_.drawings / (figure.name + ".svg")), figure.title);
      if (!figure.note.empty()) Add("<p class=\"soft\"><small>{}</small></p>", figure.note);
      html_ += "</figure>\n";
    }
    html_ += "</div>\n";
  }

  void AddFile(const std::string& name, const std::string& title, bool open) {
    const std::vector<std::string> files = run_.log().ListFiles("inputs");
    if (std::find(files.begin(), files.end(), name) == files.end()) return;
    Add("<details{}><summary>{}</summary><pre tabindex=\"0\">{}</pre></details>\n", open ? " open" : "",
        title, run_.log().ReadFile("inputs", name));
  }

  void AddInputs() {
    html_ += "<h2 id=\"inputs\">Inputs</h2>\n<div class=\"card\">\n<dl>\n";
    const auto add = [&](const char* term, const Html& value) {
      if (!value.empty()) Add("<dt>{}</dt><dd>{}</dd>\n", term, value);
    };
    const std::string command = Text("command");
    add("Command", command.empty() ? Html() : FormatHtml("<code>{}</code>", command));
    Html overrides;
    std::istringstream lines(Text("overrides"));
    for (std::string line; std::getline(lines, line);) {
      overrides += FormatHtml("{}{}", overrides.empty() ? Html() : Html("<br>"), line);
    }
    add("Overrides", overrides.empty() ? Html("none") : FormatHtml("<code>{}</code>", overrides));
    add("Seed", Html::Text(Text("seed")));
    add("Model", Html::Text(Text("robot")));
    add("MJCF", Html::Text(Text("mjcf")));
    add("dexcheck", Html::Text(Text("dexcheck_version")));
    add("MuJoCo", Html::Text(Text("mujoco_version")));
    add("Machine", Html::Text(Text("machine")));
    html_ += "</dl>\n";
    AddFile("scenario.toml", "Scenario", true);
    const std::string robot = run_.FindText("robot");
    AddFile("robot/" + robot, "Parameters of the model: " + robot, false);
    const std::string mjcf = run_.FindText("mjcf");
    AddFile("mjcf/" + mjcf, "MJCF: " + mjcf, false);
    html_ += "</div>\n";
  }

  void AddFooter() {
    Add("<footer>Made by dexcheck {} from the run's log, which holds every number, and the inputs to repeat "
        "the run bit "
        "for bit: <code>dexcheck run --replay RUN_DIR</code>. Plots by dygraphs, replay by three.js "
        "(copyright 2010-2019 three.js authors; both MIT license).</footer>\n",
        Text("dexcheck_version"));
    html_ +=
        EndPage(content_.figures, run_.time(), content_.scene.replay ? &*content_.scene.replay : nullptr);
  }

  const RunData& run_;
  const PageContent& content_;
  Html html_;
};

}  // namespace

std::string MakePage(const RunData& run, const PageContent& content) {
  try {
    return Page(run, content).Make();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(run.path().string() + ": summary: " + error.what());
  }
}

}  // namespace dexcheck
