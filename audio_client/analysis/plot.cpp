#include "audio_client/analysis/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace osteon::audio {
namespace {

using picture::Colour;
using picture::text_width;

constexpr int kTickLength = 4;
constexpr int kTickEvery_x = 90, kTickEvery_y = 18;  // pixels, about

// 1, 2 or 5 times a power of ten: about `count` steps in the axis.
double tick_step(const Axis& axis, int count) {
  const double raw = (axis.high - axis.low) / std::max(1, count);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= raw) return factor * power;
  return 10.0 * power;
}

// The multiples of a step that are on the axis.
std::vector<double> ticks(const Axis& axis, double step) {
  std::vector<double> places;
  const double first = std::ceil(axis.low / step);
  for (int i = 0; (first + i) * step <= axis.high + 1e-9 * step; ++i) places.push_back((first + i) * step);
  return places;
}

std::string tick_text(double value, double step) {
  std::array<char, 32> text{};
  const int digits = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 6);
  // No minus in front of a rounded zero.
  std::snprintf(text.data(), text.size(), "%.*f", digits, std::abs(value) < 0.5 * step ? 0.0 : value);
  return text.data();
}

}  // namespace

Plot::Plot(picture::Picture& picture, const Frame& frame, const Axis& horizontal, const Axis& vertical)
    : picture_(picture), frame_(frame), horizontal_(horizontal), vertical_(vertical) {
  const int bottom = frame.y + frame.height;
  const double step_x = tick_step(horizontal, frame.width / kTickEvery_x),
               step_y = tick_step(vertical, frame.height / kTickEvery_y);
  for (const double x : ticks(horizontal, step_x)) {
    const int at = static_cast<int>(std::lround(column(x)));
    picture.fill(at, frame.y, 1, frame.height, kGrid);
    picture.fill(at, bottom, 1, kTickLength, kInk);
    const std::string text = tick_text(x, step_x);
    picture.text(at - text_width(text) / 2, bottom + kTickLength + 3, text, kInk);
  }
  for (const double y : ticks(vertical, step_y)) {
    const int at = static_cast<int>(std::lround(row(y)));
    picture.fill(frame.x, at, frame.width, 1, kGrid);
    picture.fill(frame.x - kTickLength, at, kTickLength, 1, kInk);
    const std::string text = tick_text(y, step_y);
    picture.text(frame.x - kTickLength - 3 - text_width(text), at - 3, text, kInk);
  }
  picture.fill(frame.x, bottom, frame.width + 1, 1, kInk);
  picture.fill(frame.x - 1, frame.y, 1, frame.height + 1, kInk);
  picture.text(frame.x + frame.width - text_width(horizontal.label), bottom + kTickLength + 14, horizontal.label, kInk);
  picture.text(frame.x - 56, frame.y - 12, vertical.label, kInk);
}

void Plot::right_axis(const Axis& axis, Colour colour) {
  const int right = frame_.x + frame_.width;
  const double step = tick_step(axis, frame_.height / kTickEvery_y);
  for (const double y : ticks(axis, step)) {
    const double part = (y - axis.low) / (axis.high - axis.low);
    const int at = static_cast<int>(std::lround(frame_.y + (1.0 - part) * (frame_.height - 1)));
    picture_.fill(right, at, kTickLength, 1, colour);
    picture_.text(right + kTickLength + 3, at - 3, tick_text(y, step), colour);
  }
  picture_.fill(right, frame_.y, 1, frame_.height + 1, colour);
  picture_.text(right + kRightAxis - text_width(axis.label), frame_.y - 12, axis.label, colour);
}

double Plot::column(double x) const {
  const double part = (x - horizontal_.low) / (horizontal_.high - horizontal_.low);
  return frame_.x + std::clamp(part, -1.0, 2.0) * (frame_.width - 1);
}

double Plot::row(double y) const {
  const double part = (y - vertical_.low) / (vertical_.high - vertical_.low);
  return frame_.y + (1.0 - std::clamp(part, -1.0, 2.0)) * (frame_.height - 1);
}

void Plot::span_of_column(int at, double from_row, double to_row, Colour colour) {
  if (at < frame_.x || at >= frame_.x + frame_.width) return;
  const int top = std::max(frame_.y, static_cast<int>(std::lround(std::min(from_row, to_row))));
  const int end = std::min(frame_.y + frame_.height - 1, static_cast<int>(std::lround(std::max(from_row, to_row))));
  if (end >= top) picture_.fill(at, top, 1, end - top + 1, colour);
}

void Plot::curve(std::span<const double> x, std::span<const double> y, Colour colour) {
  for (std::size_t i = 1; i < std::min(x.size(), y.size()); ++i) {
    const double from = column(x[i - 1]), to = column(x[i]), from_row = row(y[i - 1]), to_row = row(y[i]);
    const int first = static_cast<int>(std::lround(from)), last = static_cast<int>(std::lround(to));
    if (first == last) {
      span_of_column(first, from_row, to_row, colour);
      continue;
    }
    // Within a column the line goes from one of its edges to the other.
    const auto row_at = [&](double at) {
      return from_row + (to_row - from_row) * std::clamp((at - from) / (to - from), 0.0, 1.0);
    };
    for (int at = first; at <= last; ++at) span_of_column(at, row_at(at - 0.5), row_at(at + 0.5), colour);
  }
}

void Plot::samples(std::span<const float> y, double rate, Colour colour) {
  double before = 0;
  for (int at = frame_.x; at < frame_.x + frame_.width; ++at) {
    const auto sample_at = [&](int place) {
      const double x = horizontal_.low + (horizontal_.high - horizontal_.low) * (place - frame_.x) / frame_.width;
      return static_cast<std::size_t>(std::clamp(x * rate, 0.0, static_cast<double>(y.size())));
    };
    const std::size_t first = sample_at(at), last = sample_at(at + 1);
    if (first >= last) continue;
    const auto [low, high] = std::ranges::minmax(y.subspan(first, last - first));
    // It goes on from where the column before has ended.
    span_of_column(at, row(std::min<double>(low, first > 0 ? before : low)),
                   row(std::max<double>(high, first > 0 ? before : high)), colour);
    before = y[last - 1];
  }
}

void Plot::bar(double from_x, double to_x, double from_y, double to_y, Colour colour) {
  const int first = static_cast<int>(std::lround(column(from_x))), last = static_cast<int>(std::lround(column(to_x)));
  for (int at = first; at < std::max(last, first + 1); ++at) span_of_column(at, row(from_y), row(to_y), colour);
}

void Plot::vertical_line(double x, Colour colour) {
  span_of_column(static_cast<int>(std::lround(column(x))), frame_.y, frame_.y + frame_.height - 1, colour);
}

void Plot::map(const std::function<Colour(double, double)>& colour_at) {
  for (int at = 0; at < frame_.width; ++at)
    for (int down = 0; down < frame_.height; ++down) {
      const double x = horizontal_.low + (horizontal_.high - horizontal_.low) * (at + 0.5) / frame_.width;
      const double y = vertical_.high - (vertical_.high - vertical_.low) * (down + 0.5) / frame_.height;
      picture_.set(frame_.x + at, frame_.y + down, colour_at(x, y));
    }
}

int Plot::note_column(double x, std::string_view text) const {
  const int right = frame_.x + frame_.width - text_width(text);
  return std::clamp(static_cast<int>(std::lround(column(x))) + 3, frame_.x, std::max(frame_.x, right));
}

void Plot::note(double x, int pixels_below_top, std::string_view text, Colour colour) {
  picture_.text(note_column(x, text), frame_.y + pixels_below_top, text, colour);
}

Colour heat(double part) {
  constexpr std::array<Colour, 6> kSteps = {
      {{8, 10, 40}, {30, 60, 150}, {20, 130, 140}, {110, 180, 70}, {245, 190, 60}, {255, 245, 225}}};
  const double at = std::clamp(part, 0.0, 1.0) * (kSteps.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kSteps.size() - 2);
  return picture::mixed(kSteps[below], kSteps[below + 1], at - static_cast<double>(below));
}

}  // namespace osteon::audio
