-- The rest of this script is the same for every vehicle.
-- Set SPLN_RUN to the number of a manoeuvre to drive it; 0 stops. Trim first: sticks are compared with
-- where they are when a manoeuvre begins. Outputs return to the autopilot when a manoeuvre ends.

local TICK_MS = 100
local HOLD_MS = 300
local HEARTBEAT_S = 3.0
local STICK_US = 60
local PARAM_KEY = 83
local WARNING, INFO = 4, 6

assert(param:add_table(PARAM_KEY, 'SPLN_', 1), 'seaplant: no room for a parameter table')
assert(param:add_param(PARAM_KEY, 1, 'RUN', 0), 'seaplant: no room for SPLN_RUN')

local running, began_s, sticks, origin, thrusts = 0, 0, {}, nil, {}

local function now_s()
  return millis():tofloat() / 1000
end

local function wave_at(wave, t)
  if wave.sines then
    local sum = 0
    for _, row in ipairs(wave.sines) do
      sum = sum + row[1] * math.sin(row[2] * t + row[3])
    end
    return sum
  end
  if wave.sum then
    local sum = 0
    for _, own in ipairs(wave.sum) do
      sum = sum + wave_at(own, t)
    end
    return sum
  end
  -- The clock counts milliseconds: a step begins within one of its instant.
  local within, value = (t + 1e-3) % wave.period_s, wave.steps[1][2]
  for _, row in ipairs(wave.steps) do
    if row[1] <= within then
      value = row[2]
    end
  end
  return value
end

local function clamp(x, low, high)
  return math.max(low, math.min(high, x))
end

-- North, east, down from where the manoeuvre began, angles, velocity in body axes and rates.
local function state()
  local roll, pitch, yaw = ahrs:get_roll(), ahrs:get_pitch(), ahrs:get_yaw()
  local gyro, place = ahrs:get_gyro(), ahrs:get_relative_position_NED_origin()
  local moving, depth = ahrs:get_velocity_NED(), -baro:get_altitude()
  local cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
  local cy, sy = math.cos(yaw), math.sin(yaw)
  local to_body = {
    { cy * cp, sy * cp, -sp },
    { cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr },
    { cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr },
  }
  local function turned(v)
    local out = {}
    for i = 1, 3 do
      out[i] = to_body[i][1] * v[1] + to_body[i][2] * v[2] + to_body[i][3] * v[3]
    end
    return out
  end
  local position = place and { place:x(), place:y(), place:z() }
  local v = moving and turned({ moving:x(), moving:y(), moving:z() }) or { 0, 0, 0 }
  return {
    position = position, depth = depth, angles = { roll, pitch, yaw }, turned = turned,
    velocity = { v[1], v[2], v[3], gyro:x(), gyro:y(), gyro:z() },
  }
end

-- Which part of the nearest limit is used.
local function most_used(away, s)
  local v = s.velocity
  local speed = math.sqrt(v[1] ^ 2 + v[2] ^ 2 + v[3] ^ 2)
  local stop = STOP_S2 * speed * speed
  local room = away[3] < 0 and START_DEPTH_M - DEPTH_M[1] or DEPTH_M[2] - START_DEPTH_M
  local most = math.max(
    (math.abs(away[1]) + stop) / BOX_M[1], (math.abs(away[2]) + stop) / BOX_M[2],
    (math.abs(away[3]) + stop) / room, speed / SPEED_M_S,
    math.max(math.abs(v[4]), math.abs(v[5]), math.abs(v[6])) / RATE_RAD_S,
    -- Without forces, a roll or pitch swings on until its rate is zero.
    math.sqrt(s.angles[1] ^ 2 + (v[4] * SWING_S[1]) ^ 2) / TILT_RAD,
    math.sqrt(s.angles[2] ^ 2 + (v[5] * SWING_S[2]) ^ 2) / TILT_RAD)
  if TETHER_M then
    local far = math.sqrt(away[1] ^ 2 + away[2] ^ 2 + away[3] ^ 2)
    most = math.max(most, (far + stop) / TETHER_M)
  end
  return most
end

local function hold(away, s, rad_s)
  local body = s.turned(away)
  local heading = s.angles[3] - origin.heading
  heading = math.atan(math.sin(heading), math.cos(heading))
  local off = { body[1], body[2], body[3], s.angles[1], s.angles[2], heading }
  local wrench = {}
  for k = 1, 6 do
    wrench[k] = 0
    if MOST[k] > 0 and rad_s[k] > 0 then
      local wanted = -MASS[k] * rad_s[k] ^ 2 * off[k] - 2 * DAMPING * MASS[k] * rad_s[k] * s.velocity[k]
      wrench[k] = clamp(wanted, -MOST[k], MOST[k])
    end
  end
  return wrench
end

local function share(wrench)
  local out = {}
  for k, row in ipairs(SHARE) do
    out[k] = 0
    for axis = 1, 6 do
      out[k] = out[k] + row[axis] * wrench[axis]
    end
  end
  return out
end

local function end_of(k, x)
  return math.abs(x > 0 and ALLOWED[k][2] or ALLOWED[k][1])
end

local function part_of(wanted, left)
  local part = 1
  for k, x in ipairs(wanted) do
    if x ~= 0 then
      part = math.min(part, left(k, x) / math.abs(x))
    end
  end
  return math.max(part, 0)
end

local function pulse(k, thrust)
  local curve = CURVES[k]
  if thrust == 0 then
    return curve.still
  end
  if curve.points then
    for i = 1, #curve.points - 1 do
      local a, b = curve.points[i], curve.points[i + 1]
      if b[2] > a[2] and thrust >= a[2] and thrust <= b[2] then
        return a[1] + (b[1] - a[1]) * (thrust - a[2]) / (b[2] - a[2])
      end
    end
    return thrust > 0 and curve.points[#curve.points][1] or curve.points[1][1]
  end
  local by = thrust < 0 and curve.reverse or curve.forward
  local beyond = (math.abs(thrust) / by) ^ (1 / curve.exponent) + curve.deadband
  return curve.still + curve.scale * (thrust < 0 and -beyond or beyond)
end

local function finish(why, severity)
  gcs:send_text(severity, 'seaplant: ' .. MANOEUVRES[running].name .. ' ' .. why)
  running, origin = 0, nil
  param:set('SPLN_RUN', 0)
end

local function reason_to_abort(s, away)
  if not arming:is_armed() then
    return 'aborted: disarmed'
  end
  if now_s() - gcs:last_seen():tofloat() / 1000 > HEARTBEAT_S then
    return 'aborted: no heartbeat'
  end
  for channel = 1, 6 do
    local pwm = rc:get_pwm(channel)
    if pwm and sticks[channel] and math.abs(pwm - sticks[channel]) > STICK_US then
      return 'aborted: stick input'
    end
  end
  if s.depth < DEPTH_M[1] or s.depth > DEPTH_M[2] then
    return 'aborted: depth'
  end
  if math.abs(s.angles[1]) > TILT_RAD or math.abs(s.angles[2]) > TILT_RAD then
    return 'aborted: attitude'
  end
  if away[1] ~= away[1] or not s.position then
    return 'aborted: position lost'
  end
  if math.abs(away[1]) > BOX_M[1] or math.abs(away[2]) > BOX_M[2] then
    return 'aborted: left its box'
  end
  return nil
end

local function begin(wanted, s)
  if not MANOEUVRES[wanted] then
    gcs:send_text(WARNING, 'seaplant: there is no manoeuvre ' .. tostring(wanted))
    param:set('SPLN_RUN', 0)
    return
  end
  if not arming:is_armed() or not s.position then
    local lacks = s.position and 'arm first' or 'no position; give the EKF one'
    gcs:send_text(WARNING, 'seaplant: not started: ' .. lacks)
    param:set('SPLN_RUN', 0)
    return
  end
  if math.abs(s.depth - START_DEPTH_M) > 0.5 * math.min(START_DEPTH_M - DEPTH_M[1], DEPTH_M[2] - START_DEPTH_M) then
    gcs:send_text(WARNING, string.format('seaplant: not started: go to %.1f m', START_DEPTH_M))
    param:set('SPLN_RUN', 0)
    return
  end
  running, began_s = wanted, now_s()
  origin = { position = s.position, heading = s.angles[3] }
  for channel = 1, 6 do
    sticks[channel] = rc:get_pwm(channel)
  end
  for k = 1, #SHARE do
    thrusts[k] = 0
  end
  gcs:send_text(INFO, 'seaplant: ' .. MANOEUVRES[wanted].name)
end

local function drive(s, away)
  local own, t = MANOEUVRES[running], now_s() - began_s
  local part = clamp((TAKEN - most_used(away, s)) / (TAKEN - TAKEN_BACK), 0, 1)
  local here, back = hold(away, s, own.hold_rad_s), hold(away, s, BACK_RAD_S)
  local held, asked = {}, {}
  for k = 1, 6 do
    held[k] = here[k] * part + back[k] * (1 - part)
    asked[k] = own.waves[k] and part * wave_at(own.waves[k], t) or 0
  end
  held[3] = held[3] + TRIM_N
  held, asked = share(held), share(asked)
  if own.opposing then
    local against = part * wave_at(own.opposing.wave, t)
    for k, x in ipairs(own.opposing.thrusts) do
      asked[k] = asked[k] + against * x
    end
  end
  local of_held = part_of(held, end_of)
  for k in ipairs(held) do
    held[k] = held[k] * of_held
  end
  local of_asked = part_of(asked, function(k, x)
    return end_of(k, x) - held[k] * (x > 0 and 1 or -1)
  end)
  for k in ipairs(held) do
    local wanted = held[k] + asked[k] * of_asked
    thrusts[k] = thrusts[k] + clamp(wanted - thrusts[k], -SLEW_N[k], SLEW_N[k])
    SRV_Channels:set_output_pwm_chan_timeout(CHANNEL[k], math.floor(pulse(k, thrusts[k]) + 0.5), HOLD_MS)
  end
  logger:write('SPLN', 'Run,T,Part', 'Bff', running, t, part)
end

function update()
  local wanted = math.floor((param:get('SPLN_RUN') or 0) + 0.5)
  if running == 0 and wanted == 0 then
    return update, TICK_MS
  end
  local s = state()
  if running == 0 then
    begin(wanted, s)
    if running == 0 then
      return update, TICK_MS
    end
  end
  local away = { 0 / 0, 0 / 0, 0 / 0 }
  if s.position then
    for k = 1, 3 do
      away[k] = s.position[k] - origin.position[k]
    end
  end
  local why = reason_to_abort(s, away)
  if why then
    finish(why, WARNING)
  elseif wanted ~= running then
    finish('stopped', INFO)
  elseif now_s() - began_s >= MANOEUVRES[running].seconds then
    finish('done', INFO)
  else
    drive(s, away)
  end
  return update, TICK_MS
end

return update()
