#include "interp/plan/geometry/corner_blender.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

namespace {

// The largest span that one end of an item gets when the blend at its other end wants `other`: half of the
// item, or more if the other leaves more. The rule is the same for both ends, so a path driven backwards gets
// the same blends.
double span_available(double length, double other) { return std::max(length / 2, length - other); }

// The source at s of an item that stands for many moves, as if all of them were of the same length.
SourceLine source_at(const PathItem& item, double s) {
  const double part = std::clamp(s / item.piece.length, 0.0, 1.0);
  const auto between = [part](std::uint32_t first, std::uint32_t last) {
    return first + static_cast<std::uint32_t>(part * (last - first));
  };
  const SourceLine &first = item.source, &last = item.last_source;
  return {between(first.line, last.line), between(first.step, last.step)};
}

// Shorter remainders than this are rounding.
constexpr double kRemainderMin = 1e-11;

}  // namespace

void CornerBlender::add(const PathItem& item) {
  if (!first_) {
    first_ = item;
    first_from_ = span_before_ = 0;
    return;
  }
  const Junction next = classify(second_ ? *second_ : *first_, item);
  if (second_) resolve_junction(next.span);
  second_ = item;
  junction_ = next;
}

void CornerBlender::stop() {
  if (second_) resolve_junction(0);
  if (first_) emit_remainder(*first_, first_from_, first_->piece.length);
  first_.reset();
  end_stretch();
}

// Emits the rest of first_ and the blend that joins it to second_; second_ becomes first_. The junction's own
// span was found with both items to itself. Now the neighbouring junctions have their share: where that
// leaves less, the span is searched again under the smaller bound, and a blend that becomes too short is a
// stop.
void CornerBlender::resolve_junction(double span_after_next) {
  TRN_CHECK(first_ && second_);
  TRN_CHECK(span_after_next >= 0);
  const PathPiece& before = first_->piece;
  const PathPiece& after = second_->piece;
  double span = std::min({junction_.span, span_available(before.length, span_before_),
                          span_available(after.length, span_after_next)});
  if (junction_.kind == Junction::Kind::kBlend) {
    // The blend lies on both items, so the stricter tolerance of the two holds.
    const BlendBounds bounds{std::min(first_->tolerance_mm, second_->tolerance_mm),
                             std::min(first_->tolerance_rad, second_->tolerance_rad), span};
    if (span < junction_.span) span = largest_span(before, after, bounds);
    if (span < kBlendSpanMin) junction_ = {};
  }
  const bool blend = junction_.kind == Junction::Kind::kBlend;
  emit_remainder(*first_, first_from_, before.length - (blend ? span : 0));
  if (junction_.kind == Junction::Kind::kStop) end_stretch();
  if (blend) {
    const PathPiece whole = make_blend(before, after, span);
    // In halves, each under its own item's feed limit, outputs and source line.
    emit(*first_, cut(whole, 0, span), source_at(*first_, before.length - span));
    emit(*second_, cut(whole, span, 2 * span), second_->source);
  }
  first_from_ = blend ? span : 0;
  span_before_ = blend ? junction_.span : 0;
  first_ = std::move(second_);
  second_.reset();
}

void CornerBlender::emit_remainder(PathItem& item, double from, double to) {
  if (to - from < kRemainderMin) return;
  const bool whole = from == 0 && to == item.piece.length;
  emit(item, whole ? item.piece : cut(item.piece, from, to), item.source);
}

void CornerBlender::emit(PathItem& item, const PathPiece& piece, SourceLine source) {
  TRN_CHECK(piece.length > 0);
  if (held_) sink_.piece(*held_);
  held_ = PlanPiece{piece, item.context, item.feed, item.rapid, false, source, item.outputs};
  item.outputs = {};  // with its first piece
}

void CornerBlender::end_stretch() {
  if (!held_) return;
  held_->ends_stretch = true;
  sink_.piece(*held_);
  held_.reset();
}

}  // namespace trn
