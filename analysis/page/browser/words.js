/** The page's words in English and Japanese. */

import { state } from "./state.js";

/** @type {Record<string, [string, string]>} English, Japanese */
export const WORDS = {
  language: ["Language", "言語"],
  theme: ["Colours", "配色"],
  auto: ["as the system", "システムに合わせる"],
  light: ["light", "ライト"],
  dark: ["dark", "ダーク"],
  skip: ["Skip to the findings", "結果へ移動"],
  sections: ["Sections", "目次"],
  findings: ["Findings", "結果"],
  diagram: ["Time-distance diagram", "列車ダイヤ"],
  train_view: ["One train", "列車"],
  line_view: ["The line", "路線"],
  animation: ["Animation", "アニメーション"],
  papers: ["Beside published figures", "論文の値との比較"],
  about: ["How it was made", "作成条件"],
  results: ["Results", "結果フォルダ"],
  shown_controllers: ["Controllers shown", "表示する制御方式"],
  all: ["all", "すべて"],
  few: ["baseline and best", "基準と最良"],
  controller: ["Controller", "制御方式"],
  second: ["beside", "比較対象"],
  train: ["Train", "列車"],
  find_train: ["Find a train, also with a time: 723B 07:36", "列車を検索(時刻も可):723B 07:36"],
  find: ["Show", "表示"],
  no_such_train: ["There is no train {train}.", "列車 {train} はない。"],
  seed: ["Seed", "シード"],
  initial_delay: ["Initial delay", "初期遅延"],
  verdict: ["Verdict", "判定"],
  safety: ["Safety", "安全"],
  comparison: ["Comparison", "比較"],
  comparison_told: [
    "Means over {runs} runs of each controller; below them the change against {baseline}. ★ best of the row, ✓ better, ✗ worse, ≈ no difference that counts.",
    "各制御方式 {runs} 回の平均。下段は {baseline} との差。★ 行の最良、✓ 改善、✗ 悪化、≈ 有意な差なし。",
  ],
  comparison_one: [
    "One run of each controller; below it the change against {baseline}. ★ best of the row, ✓ better, ✗ worse, ≈ no difference that counts.",
    "各制御方式 1 回の結果。下段は {baseline} との差。★ 行の最良、✓ 改善、✗ 悪化、≈ 有意な差なし。",
  ],
  interval_told: [
    "± is half of the 95 % confidence interval of the differences, paired by seed.",
    "± はシードごとの差の 95 % 信頼区間の半幅。",
  ],
  indicator: ["indicator", "指標"],
  baseline: ["baseline", "基準"],
  better: ["better", "改善"],
  worse: ["worse", "悪化"],
  alike: ["alike", "差なし"],
  best: ["best", "最良"],
  knows_future: ["knows the future, for comparison only", "将来を知る(参考)"],
  only_compared: ["for comparison", "参考"],
  peer_drives: ["driven by another program, for comparison only", "他プログラムが運転(参考)"],
  north: ["N", "北"],
  moment_at: ["At {time}, {controller}:", "{time}、{controller}:"],
  since: ["since {time}", "{time} から"],
  overstays_by: ["overstays by {seconds} s", "停車超過 {seconds} 秒"],
  owed_to: ["What {train} owes to others comes mostly from: {told}.", "{train} の二次遅延の主な発端:{told}。"],
  mostly_from: ["It comes mostly from: {told}.", "主な発端:{told}。"],
  not_competing: ["unsafe or unfinished", "違反または未完了"],
  gains: ["What each controller gains and gives up", "得るものと失うもの"],
  gains_told: [
    "Change against {baseline}. Left and low is better. The line joins those that no other one beats in both; a hollow mark is beaten in stops, delay and energy at once.",
    "{baseline} との差。左下ほど良い。線は両方で他に負けない方式を結ぶ。白抜きは停車・遅延・電力量のすべてで他に劣る方式。",
  ],
  over_seeds: ["Seed by seed", "シードごとの分布"],
  over_seeds_told: [
    "A dot is a run, the bar the mean with its 95 % confidence interval.",
    "点は 1 回の結果、棒は平均とその 95 % 信頼区間。",
  ],
  booked: ["booked", "計画"],
  stops_between: ["stops between stations", "駅間停車"],
  injected: ["injected delays", "与えた遅延"],
  obstructions: ["points, crossings, closures", "転てつ器・踏切・支障"],
  bands: ["way given to the train", "進行許可区間"],
  train_numbers: ["train numbers", "列車番号"],
  zoom_in: ["Zoom in", "拡大"],
  zoom_out: ["Zoom out", "縮小"],
  whole: ["Whole", "全体"],
  keys: [
    "Drag to move; Ctrl and wheel, two fingers, + and - to zoom; arrows move; 0 shows all; [ and ] choose the train before or after.",
    "ドラッグで移動、Ctrl+ホイール・2本指・+ - で拡大縮小、矢印キーで移動、0 で全体、[ ] で前後の列車。",
  ],
  time: ["Time", "時刻"],
  distance: ["Distance", "距離"],
  over_time: ["over time", "時刻軸"],
  over_distance: ["over distance", "距離軸"],
  speed: ["speed", "速度"],
  limit: ["line limit", "制限速度"],
  authority_curve: ["brake curve to the end of authority", "進行許可終端へのブレーキ曲線"],
  power: ["power (estimated from the samples)", "電力(サンプルから推定)"],
  energy: ["energy", "電力量"],
  energy_told: [
    "{train} under {controller}: {gross} kWh gross, {recovered} kWh recovered, {net} kWh net (table energy).",
    "{controller} の {train}:消費 {gross} kWh、回生 {recovered} kWh、正味 {net} kWh(energy 表)。",
  ],
  why: ["What bound the speed", "速度を決めた要因"],
  phases: ["The ribbon as a table", "要因の表"],
  calls: ["Calls of the train", "列車の着発"],
  from: ["from", "開始"],
  to: ["to", "終了"],
  place: ["place", "位置"],
  reason: ["bound by", "要因"],
  cause: ["because of", "原因"],
  duration: ["duration", "時間"],
  station: ["station", "駅"],
  track: ["track", "番線"],
  arrival: ["arrival", "到着"],
  departure: ["departure", "出発"],
  booked_arrival: ["booked arr.", "計画着"],
  booked_departure: ["booked dep.", "計画発"],
  arrival_delay: ["arrival delay", "到着遅延"],
  departure_delay: ["departure delay", "出発遅延"],
  primary_delay: ["primary delay", "一次遅延"],
  dwell_delay: ["overstay", "停車超過"],
  secondary_delay: ["secondary delay", "二次遅延"],
  leader: ["ahead", "先行"],
  delay: ["delay", "遅延"],
  stands: ["stands", "停車中"],
  delays_by_place: ["Delay by train and station", "列車・駅別の遅延"],
  heat_told: [
    "Rows are trains as they come, columns stations. Choose a cell to see the train.",
    "行は列車、列は駅。セルを選ぶと列車を表示する。",
  ],
  measure: ["Shown", "表示"],
  headways: ["Headways and dwells by station", "駅別の運転間隔と停車時間"],
  headways_told: [
    "Departure of the train ahead to arrival, and dwell, at each platform: median, and from the 10th to the 90th percentile.",
    "先行列車の発車から到着まで、および停車時間。中央値と 10~90 パーセンタイル。",
  ],
  interval: ["departure to arrival", "発車から到着まで"],
  dwell: ["dwell", "停車時間"],
  stops_by_place: ["Stops between stations by place", "駅間停車の位置"],
  stops_told: [
    "A stem is a stop, as high as it was long. Choose one to see the train.",
    "棒は 1 回の停車で、高さは時間。選ぶと列車を表示する。",
  ],
  who_delayed: ["Who delayed whom", "遅延の伝播"],
  who_told: [
    "Every lateness is followed back along the trains ahead to where it began; open an origin to see whom it reached. The longest first.",
    "遅れを先行列車へとさかのぼり、発端ごとにまとめた。開くと波及先が見える。長い順。",
  ],
  overstay: ["overstays at {station}", "{station}で停車超過"],
  own_run: ["late by its own run", "自列車の走行による遅れ"],
  in_the_way: ["in the way", "支障"],
  unknown: ["not known", "不明"],
  costs_others: ["costs others {seconds} s, {trains} trains", "他列車に {seconds} 秒、{trains} 列車"],
  costs_one: ["costs another one {seconds} s", "他の 1 列車に {seconds} 秒"],
  more_origins: ["{count} more origins", "ほか {count} 件"],
  longest_secondary: [
    "Most lateness owed to others at one arrival: train {train} at {station}, {seconds} s.",
    "1 回の到着での最大の二次遅延:列車 {train}、{station}、{seconds} 秒。",
  ],
  no_tree: ["Without a trajectory of this run nobody knows who delayed whom.", "この回の走行記録がないため、遅延の伝播は不明である。"],
  nobody_delayed: ["No train was delayed by another one.", "他列車による遅延はない。"],
  play: ["Play", "再生"],
  pause: ["Pause", "一時停止"],
  speed_of_play: ["times as fast", "倍速"],
  blocks: ["signals and points", "信号と転てつ器"],
  map: ["Map", "地図"],
  schematic: ["Line", "配線略図"],
  no_map: ["These results have no coordinates.", "座標がない。"],
  same_place: ["All places by chainage.", "キロ程による。"],
  published: ["published", "論文"],
  ours: ["here", "本結果"],
  deviation: ["difference", "差"],
  no_papers: [
    "No published figure belongs to these results. docs/papers.md has the comparisons with papers.",
    "この結果に対応する論文の値はない。論文との比較は docs/papers.md にある。",
  ],
  intervals_by_delay: ["Interval by initial delay", "初期遅延と運転間隔"],
  key: ["key", "項目"],
  value: ["value", "値"],
  provenance: ["Provenance", "来歴"],
  cite: ["How to cite", "引用"],
  cite_papers: ["and the paper of each method that you use:", "および使用した手法の論文:"],
  section_failed: ["This part could not be made: {why}", "この部分は表示できない:{why}"],
  copy: ["Copy", "コピー"],
  copied: ["Copied", "コピーした"],
  meanings: ["What the indicators mean", "指標の意味"],
  notes: ["To know about these results", "この結果について"],
  no_trajectory: [
    "These results keep no trajectory of this run: lines join the calls.",
    "この回の走行記録はない。線は着発時刻を結ぶ。",
  ],
  no_trip: ["No samples of train {train} under {controller}.", "{controller} に列車 {train} の記録はない。"],
  no_line: [
    "These results say nothing of limits, gradients and train data, so they are not drawn.",
    "この結果には制限速度・勾配・車両データがないため描かない。",
  ],
  legend: ["Legend", "凡例"],
  at: ["at", "時刻"],
  trains_on_line: ["{count} trains on the line", "在線 {count} 列車"],
  running: ["running", "走行中"],
  ready: ["ready", "準備完了"],
  failed: ["The page could not be made: {why}", "表示できない:{why}"],
  trains_controllers_seeds: [
    "{trains} trains, {controllers} controllers, {seeds}",
    "{trains} 列車、{controllers} 方式、{seeds}",
  ],
  seeds_told: ["seeds {seeds}", "シード {seeds}"],
  stage_none: ["No train is chosen.", "列車が選ばれていない。"],
  violations: ["Violated safety rules", "安全規則の違反"],
  unfinished: ["Trains still under way at the end", "終了時に運行中の列車"],
  message: ["what", "内容"],
  gross: ["gross", "消費"],
  recovered: ["recovered", "回生"],
  net: ["net", "正味"],
  several: ["All results", "全結果"],
};

/** @type {Record<string, [string, string]>} what may bind a train's speed */
export const REASONS = {
  traction: ["its own power", "自列車の加速"],
  line_limit: ["speed limit", "制限速度"],
  train_ahead: ["train ahead", "先行列車"],
  obstruction_ahead: ["points, crossing or closure ahead", "前方の転てつ器・踏切・支障"],
  station_stop: ["braking for its own stop", "停車のための減速"],
  plan: ["plan of the operation", "運転計画"],
  emergency: ["emergency brake", "非常ブレーキ"],
  peer: ["another program", "他のプログラム"],
  dwelling: ["dwelling at a platform", "停車中"],
  held: ["held at its platform", "発車抑止"],
};

/** @type {Record<string, string>} Japanese names of indicators */
export const INDICATORS_JA = {
  interstation_stop_time_s: "駅間停車時間",
  interstation_stops: "駅間停車回数",
  interstation_crawl_time_s: "駅間低速時間",
  held_open_time_s: "抑止(ドア開)",
  held_closed_time_s: "抑止(ドア閉)",
  closed_doors_time_s: "ドア閉後の停車",
  mean_arrival_delay_s: "平均到着遅延",
  mean_delay_bound_s: "平均到着遅延の下限",
  delay_above_bound_s: "下限を超える遅延",
  final_arrival_delay_s: "終着駅の遅延",
  secondary_delay_s: "二次遅延",
  scheduled_speed_kmh: "表定速度",
  energy_gross_kwh: "消費電力量",
  energy_net_kwh: "正味電力量",
  jerk_mps3: "ジャーク(r.m.s.)",
};

/**
 * A word of the page in the language that is chosen.
 * @param {string} key
 * @param {Record<string, string | number>} [told]
 * @returns {string}
 */
export function word(key, told = {}) {
  const text = (WORDS[key] ?? [key, key])[state.language === "ja" ? 1 : 0];
  return text.replace(/\{(\w+)\}/g, (all, name) => (name in told ? String(told[name]) : all));
}

/**
 * @param {string} reason
 * @param {string} plan the operation's own word
 * @returns {string}
 */
export function reasonWord(reason, plan) {
  const known = REASONS[reason];
  const told = known ? known[state.language === "ja" ? 1 : 0] : reason;
  return plan ? `${told}: ${plan.replaceAll("_", " ")}` : told;
}

/**
 * @param {{name: string, local: string}} station
 * @returns {string}
 */
export function stationName(station) {
  return state.language === "ja" ? station.local : station.name;
}

/**
 * @param {{name: string, label: string, unit: string}} indicator
 * @returns {string}
 */
export function indicatorName({ name, label, unit }) {
  const told = (state.language === "ja" && INDICATORS_JA[name]) || label || name.replaceAll("_", " ");
  return unit ? `${told} [${unit}]` : told;
}
