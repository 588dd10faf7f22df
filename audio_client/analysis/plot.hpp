// Plots with axes on a picture: curves, bars, coloured spans and maps of colours.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "common/picture/picture.hpp"

namespace osteon::audio {

inline constexpr picture::Colour kPaper{255, 255, 255}, kInk{43, 43, 43}, kGrid{225, 225, 225};

struct Axis {
  double low = 0, high = 1;  // different, and finite
  std::string label;         // with the unit
};

// The part of a picture within the axes, pixels from the upper left corner.
struct Frame {
  int x = 0, y = 0, width = 1, height = 1;
};

// One pair of axes. Everything is clipped to the frame.
class Plot {
 public:
  // Draws grid, numbers and labels around the frame, for which it needs 60 pixels on the left and 36 below.
  Plot(picture::Picture& picture, const Frame& frame, const Axis& horizontal, const Axis& vertical);

  // A second vertical axis at the right, for a curve() that is scaled to it. It needs kRightAxis pixels there.
  void right_axis(const Axis& axis, picture::Colour colour);
  static constexpr int kRightAxis = 44;

  // Joins the points (x[i], y[i]); x rises. Of points in one column of pixels, it draws the whole range.
  void curve(std::span<const double> x, std::span<const double> y, picture::Colour colour);
  // The same for samples at x = i / rate, whose number may be large.
  void samples(std::span<const float> y, double rate, picture::Colour colour);
  void bar(double from_x, double to_x, double from_y, double to_y, picture::Colour colour);
  void vertical_line(double x, picture::Colour colour);
  // The colour of each pixel by its place on the axes.
  void map(const std::function<picture::Colour(double x, double y)>& colour_at);
  void note(double x, int pixels_below_top, std::string_view text, picture::Colour colour);
  // The first column of pixels of such a note.
  [[nodiscard]] int note_column(double x, std::string_view text) const;

 private:
  [[nodiscard]] double column(double x) const;
  [[nodiscard]] double row(double y) const;
  void span_of_column(int column, double from_row, double to_row, picture::Colour colour);

  picture::Picture& picture_;
  Frame frame_;
  Axis horizontal_, vertical_;
};

// Cold for 0, warm for 1, as in Figure 8.13; brightness rises all the way, so that it can be read without colours.
[[nodiscard]] picture::Colour heat(double part);

}  // namespace osteon::audio
